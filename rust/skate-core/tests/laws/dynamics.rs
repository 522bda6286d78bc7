//! Inertia matrix, bias forces and accelerations: the engine's algorithms against textbook forms and dense
//! solutions.

use super::{bare, draw};
use rand::{Rng, SeedableRng};
use rand_chacha::ChaCha8Rng;
use skate_core::{
    dynamics::{aba::Forces, bias_forces},
    model::{
        Model,
        contact_mode::{ContactMode, Foot, SoleContact},
        friction::FrictionMode,
        layout::NV,
    },
    rhs::{Evaluation, StepContext},
    scene::Scene,
    sim::Simulation,
};

#[test]
fn the_body_agrees_with_table_1() {
    let body = Scene::default().body;
    assert!((body.mass() - 64.2).abs() < 1e-12, "{}", body.mass());
    assert!((body.height() - 1.70).abs() < 1e-12);
}

/// Columns of M are inverse dynamics of unit accelerations (Featherstone 2008, section 6.1).
#[test]
fn crba_agrees_with_rnea() {
    let mut rng = ChaCha8Rng::seed_from_u64(1);
    for scene in ["{}", r#"{"locked": ["q8", "q10", "q12"]}"#] {
        let model = bare(scene);
        let n = model.n;
        let mut worst: f64 = 0.0;
        for _ in 0..200 {
            let (q, v) = (draw(&mut rng, n, 1.5), draw(&mut rng, n, 10.0));
            let mut eval = Evaluation::default();
            eval.set_configuration(&model, SoleContact::Toe, &q, &v);
            eval.inertias.update(&model, &eval.kin);
            let M = eval.inertias.crba(&model, &eval.kin);
            let dense = M.as_slice();
            let mut bias = [0.0; NV];
            eval.inertias
                .inverse_dynamics(&model, &eval.kin, &[0.0; NV], &mut bias);
            let size = dense.iter().fold(0.0, |top: f64, x| top.max(x.abs()));
            for c in 0..n {
                let mut unit = [0.0; NV];
                unit[c] = 1.0;
                let mut tau = [0.0; NV];
                eval.inertias
                    .inverse_dynamics(&model, &eval.kin, &unit, &mut tau);
                for i in 0..n {
                    let scale = size + bias[i].abs();
                    worst = worst.max((tau[i] - bias[i] - dense[i * n + c]).abs() / scale);
                }
            }
        }
        // Measured 2.4e-14.
        assert!(worst < 1e-12, "{worst:e}");
    }
}

/// Models with all subsets of locked trunk joints, each with a few sets of locked limb joints; and the
/// locked joints.
fn locked() -> impl Iterator<Item = (Vec<String>, Model)> {
    let mut rng = ChaCha8Rng::seed_from_u64(5);
    (0..64_u32).map(move |mask| {
        let limbs: u32 = rng.random_range(0..128);
        let mask = (mask & 7) | if mask < 8 { 0 } else { limbs << 3 };
        let locked = (0..10).filter(|i| mask & (1 << i) != 0);
        let locked: Vec<String> = locked.map(|i| format!("\"q{}\"", 8 + i)).collect();
        let model = bare(&format!(r#"{{"locked": [{}]}}"#, locked.join(",")));
        (locked, model)
    })
}

/// Kinetic energy is v^T M v / 2. The rate of the potential energy at rest is the power against the bias
/// forces h + g.
#[test]
fn energy_agrees_with_mass_matrix_and_gravity() {
    let mut rng = ChaCha8Rng::seed_from_u64(7);
    let (mut worst, mut steepest): (f64, f64) = (0.0, 0.0);
    for (locked, model) in locked() {
        let n = model.n;
        for _ in 0..10 {
            let (q, v) = (draw(&mut rng, n, 1.5), draw(&mut rng, n, 5.0));
            let potential = |q: &[f64; NV]| {
                let mut eval = Evaluation::default();
                eval.set_configuration(&model, SoleContact::Toe, q, &[0.0; NV]);
                bias_forces::energy(&model, &eval.kin, &[0.0; NV], q[1]).1
            };
            let mut eval = Evaluation::default();
            eval.full_kinematics(&model, SoleContact::Toe, &q, &v);
            let M = eval.inertias.crba(&model, &eval.kin);
            let dense = M;
            let moving = nalgebra::DVector::from_column_slice(&v[..n]);
            let expected = 0.5 * moving.dot(&(&dense * &moving));
            let (kinetic, _) = bias_forces::energy(&model, &eval.kin, &v, q[1]);
            worst = worst.max((kinetic / expected - 1.0).abs());

            let mut bias = [0.0; NV];
            eval.full_kinematics(&model, SoleContact::Toe, &q, &[0.0; NV]);
            eval.inertias
                .inverse_dynamics(&model, &eval.kin, &[0.0; NV], &mut bias);
            let along = |h: f64| std::array::from_fn(|c| q[c] + h * v[c]);
            let rise = (potential(&along(1e-5)) - potential(&along(-1e-5))) / 2e-5;
            let weighs: f64 = bias.iter().zip(&v).map(|(g, v)| g * v).sum();
            steepest = steepest.max((rise - weighs).abs());
        }
        // Measured at most 5.3e-15; and 2.5e-5 W of some kilowatts, by finite differences.
        assert!(worst < 1e-12, "{locked:?}: {worst:e}");
        assert!(steepest < 1e-3, "{locked:?}: {steepest:e}");
    }
}

/// The articulated-body algorithm gives accelerations x with M x + h + g = tau, with M and h + g from CRBA
/// and RNEA.
#[test]
fn articulated_bodies_agree_with_a_dense_solution() {
    let mut rng = ChaCha8Rng::seed_from_u64(6);
    let mut worst: f64 = 0.0;
    for (locked, model) in locked() {
        let n = model.n;
        for _ in 0..10 {
            let (q, v) = (draw(&mut rng, n, 1.5), draw(&mut rng, n, 5.0));
            let tau = draw(&mut rng, n, 100.0);
            let mut eval = Evaluation::default();
            eval.full_kinematics(&model, SoleContact::Toe, &q, &v);
            let M = eval.inertias.crba(&model, &eval.kin);
            let mut bias = [0.0; NV];
            eval.inertias
                .inverse_dynamics(&model, &eval.kin, &[0.0; NV], &mut bias);
            let dense = M;

            eval.factored.tree.factor(&model, &eval.kin, None);
            let mut x = tau;
            let mut forces = Forces::default();
            bias_forces::forces(&model, &eval.kin, &v, &mut forces);
            eval.factored.tree.reduce(&model, &mut forces, &mut x);
            let root = nalgebra::Vector3::new(x[0], x[1], x[2]);
            let root = eval
                .factored
                .tree
                .root()
                .lu()
                .solve(&root)
                .expect("S is positive definite");
            x[..3].copy_from_slice(root.as_slice());
            eval.factored.tree.expand(&model, &mut x);
            let x = nalgebra::DVector::from_column_slice(&x[..n]);
            let size = dense.amax() * x.amax();
            let force = dense * x;
            for i in 0..n {
                let error = (force[i] + bias[i] - tau[i]).abs() / size;
                assert!(error < 1e-9, "{locked:?}: {i} is {error:e}");
                worst = worst.max(error);
            }
        }
    }
    // Measured 3.2e-16.
    assert!(worst < 1e-12, "{worst:e}");
}

/// Entries beyond a model's coordinates hold other data in the integrated vector; here they are NaN.
#[test]
fn missing_coordinates_are_not_read() {
    let mut rng = ChaCha8Rng::seed_from_u64(8);
    let every = ["q8", "q9", "q10", "q11", "q14", "q17"];
    for count in 0..=every.len() {
        let model = bare(&format!(
            r#"{{"locked": {:?}, "stabilizers": {{"head_damping": {{"y": 20, "z": 30}}}},
            "control": {{"lifting": {{"K_p": [300, 400, 5000], "ahead": 0.7, "height": 1.9}},
            "feedforward": {{"tau7_scale": 1}}}}}}"#,
            &every[..count]
        ));
        let mut state = Simulation::new(model.clone()).expect("a start").state;
        state.controller.supported = true;
        for touch in [
            SoleContact::Air,
            SoleContact::Heel,
            SoleContact::Toe,
            SoleContact::Flat,
        ] {
            state.mode = ContactMode {
                support: Foot::new(SoleContact::Toe, FrictionMode::Forward),
                free: Foot::new(touch, FrictionMode::Forward),
            };
            let frozen = StepContext::of(&model, &state, &[0.0; NV]);
            let (mut q, mut v) = (draw(&mut rng, model.n, 0.7), draw(&mut rng, model.n, 5.0));
            let accelerations = |q: &[f64; NV], v: &[f64; NV]| {
                let mut eval = Evaluation::default();
                eval.accelerations(&model, q, v, &frozen)
                    .map(|()| (eval.qdd, eval.tau, eval.solution.f_root))
            };
            let clean = accelerations(&q, &v).expect("a motion");
            q[model.n..].fill(f64::NAN);
            v[model.n..].fill(f64::NAN);
            assert_eq!(clean, accelerations(&q, &v).expect("the same motion"));
        }
    }
}
