//! Laws that the engine was not derived from.
#![allow(non_snake_case)]

use rand::{Rng, SeedableRng};
use rand_chacha::ChaCha8Rng;
use skate_core::{
    articulated::Forces,
    contact::{Foot, Grip, Mode, TABLE_2, Touch, problem::unknowns},
    evaluate::{Evaluation, Frozen},
    inertial,
    integrate::{Flow, dopri5::Step},
    model::{Model, NV},
    packed::PackedMatrix,
    relabel,
    scene::Scene,
    sim::Simulation,
    transition::EDGES,
};

fn draw(rng: &mut ChaCha8Rng, n: usize, size: f64) -> [f64; NV] {
    std::array::from_fn(|i| {
        if i < n {
            rng.random_range(-size..size)
        } else {
            0.0
        }
    })
}

fn bare(extra: &str) -> Model {
    Model::compile(&Scene::from_json(extra).expect("a scene")).expect("a model")
}

const LOCKED: &str = r#""locked": ["q8","q9","q10","q11","q12","q13","q14","q15","q16","q17"]"#;

#[test]
fn the_body_is_table_1s() {
    let body = Scene::default().body;
    assert!((body.mass() - 64.2).abs() < 1e-12, "{}", body.mass());
    assert!((body.height() - 1.70).abs() < 1e-12);
}

/// Columns of M are inverse dynamics of unit accelerations (Featherstone 2008, section 6.1).
#[test]
fn crba_equals_rneas_columns() {
    let mut rng = ChaCha8Rng::seed_from_u64(1);
    for scene in ["{}", r#"{"locked": ["q8", "q10", "q12"]}"#] {
        let model = bare(scene);
        let n = model.n;
        let mut worst: f64 = 0.0;
        for _ in 0..200 {
            let (q, v) = (draw(&mut rng, n, 1.5), draw(&mut rng, n, 10.0));
            let mut eval = Evaluation::default();
            eval.move_to(&model, Touch::Toe, &q, &v);
            eval.inertias.update(&model, &eval.kin);
            let mut M = PackedMatrix::default();
            eval.inertias.crba(&model, &eval.kin, &mut M);
            let dense = M.dense(&model);
            let mut bias = [0.0; NV];
            eval.inertias.bias(&model, &eval.kin, &mut bias);
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

/// Articulated bodies give accelerations x with M x + h + g = tau, M and h + g from elsewhere.
#[test]
fn articulated_bodies_equal_a_dense_solution() {
    let mut rng = ChaCha8Rng::seed_from_u64(5);
    let every = [
        "q8", "q9", "q10", "q11", "q12", "q13", "q14", "q15", "q16", "q17",
    ];
    let mut worst: f64 = 0.0;
    // All ways to lock the trunk, each with a few to lock the limbs.
    for mask in 0..64_u32 {
        let limbs: u32 = rng.random_range(0..128);
        let mask = (mask & 7) | if mask < 8 { 0 } else { limbs << 3 };
        let locked: Vec<String> = (0..10)
            .filter(|i| mask & (1 << i) != 0)
            .map(|i| format!("\"{}\"", every[i]))
            .collect();
        let model = bare(&format!(r#"{{"locked": [{}]}}"#, locked.join(",")));
        let n = model.n;
        for _ in 0..10 {
            let (q, v) = (draw(&mut rng, n, 1.5), draw(&mut rng, n, 5.0));
            let tau = draw(&mut rng, n, 100.0);
            let mut eval = Evaluation::default();
            eval.survey(&model, Touch::Toe, &q, &v);
            let mut M = PackedMatrix::default();
            eval.inertias.crba(&model, &eval.kin, &mut M);
            let mut bias = [0.0; NV];
            eval.inertias.bias(&model, &eval.kin, &mut bias);
            let dense = nalgebra::DMatrix::from_vec(n, n, M.dense(&model));

            eval.M.factor(&model, &eval.kin);
            let mut x = tau;
            let mut forces = Forces::default();
            inertial::forces(&model, &eval.kin, &v, &mut forces);
            eval.M.reduce(&model, &eval.kin, &mut forces, &mut x);
            let root = nalgebra::Vector3::new(x[0], x[1], x[2]);
            let root = eval
                .M
                .root()
                .lu()
                .solve(&root)
                .expect("S is positive definite");
            x[..3].copy_from_slice(root.as_slice());
            eval.M.expand(&model, &eval.kin, &mut x);
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

/// The integrated vector is dense: behind a model's q and v stand other things, here NaN.
#[test]
fn what_a_model_does_not_have_is_not_read() {
    let mut rng = ChaCha8Rng::seed_from_u64(8);
    let every = ["q8", "q9", "q10", "q11", "q14", "q17"];
    for count in 0..=every.len() {
        let model = bare(&format!(
            r#"{{"locked": {:?}, "helpers": {{"head_damping": {{"y": 20, "z": 30}}}},
            "control": {{"lifting": {{"K_p": [300, 400, 5000], "ahead": 0.7, "height": 1.9}},
            "feedforward": {{"tau7_scale": 1}}}}}}"#,
            &every[..count]
        ));
        let mut state = Simulation::new(model.clone()).expect("a start").state;
        state.clock.supported = true;
        for touch in [Touch::Air, Touch::Heel, Touch::Toe, Touch::Flat] {
            state.mode = Mode {
                support: Foot::new(Touch::Toe, Grip::Forward),
                free: Foot::new(touch, Grip::Forward),
            };
            let frozen = Frozen::of(&model, &state, &[0.0; NV]);
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

/// Every row of Table 2 belongs to exactly one pair of feet, the number finds it, and a state has no
/// unknowns but those of its row.
#[test]
fn table_2_is_a_product() {
    let mut seen = [0; 21];
    for support in [Touch::Flat, Touch::Toe] {
        for grip in [Grip::Stuck, Grip::Forward] {
            for free in [Touch::Air, Touch::Heel, Touch::Flat] {
                for free_grip in [Grip::Stuck, Grip::Forward] {
                    let mode = Mode {
                        support: Foot::new(support, grip),
                        free: Foot::new(free, free_grip),
                    };
                    if free == Touch::Air && free_grip == Grip::Forward {
                        continue;
                    }
                    let number = mode.number();
                    seen[number as usize] += 1;
                    let row = TABLE_2[number as usize - 1];
                    assert_eq!(row.number, number);
                    assert_eq!(row.y0, grip != Grip::Stuck);
                    assert_eq!(row.q1, support != Touch::Flat);
                    assert_eq!(row.f_nz, free != Touch::Air);
                    assert_eq!(row.tau_n, free == Touch::Flat);
                    assert_eq!(row.f_ny, free != Touch::Air && free_grip == Grip::Stuck);
                    let multipliers = [row.f_nz, row.tau_n, row.f_ny];
                    let unknown = [
                        [row.y0, row.q1].map(usize::from).iter().sum::<usize>(),
                        multipliers.map(usize::from).iter().sum(),
                    ];
                    assert_eq!(unknowns(mode), unknown.into(), "state {number}");
                }
            }
        }
    }
    assert!(seen[1..].iter().all(|&count| count == 1), "{seen:?}");
}

/// The paper's cycle 3 -> 7 -> 15 -> 16 -> 14 -> 3 can be walked along the edges.
#[test]
fn the_edges_hold_the_papers_cycle() {
    use Touch::{Air, Flat, Heel, Toe};
    let leads = |from, to, swap| {
        EDGES
            .iter()
            .any(|e| (e.from, e.to, e.swap) == (from, to, swap))
    };
    assert!(leads((Flat, Air), (Flat, Heel), false));
    assert!(leads((Flat, Heel), (Flat, Flat), false));
    assert!(leads((Flat, Flat), (Toe, Flat), false));
    assert!(leads((Toe, Flat), (Flat, Air), true));
}

/// A swap of the legs names the same motion anew.
#[test]
fn a_swap_keeps_energy_and_momentum_and_undoes_itself() {
    let model = bare("{}");
    let mut rng = ChaCha8Rng::seed_from_u64(2);
    let lifted = bare(r#"{"start": {"q": {"q5": 0.5, "q6": -0.8, "q7": 0.3}}}"#);
    let sim = Simulation::new(lifted).expect("standing on one leg");
    let mut worst: f64 = 0.0;
    for _ in 0..200 {
        let mut state = sim.state;
        state.q = draw(&mut rng, model.n, 1.5);
        state.v = draw(&mut rng, model.n, 5.0);
        let air = Foot::AIR;
        state.mode = Mode {
            support: air,
            free: air,
        };
        let (q, v) = (state.q, state.v);
        let mut eval = Evaluation::default();
        let measure = |state: &skate_core::state::State| {
            let mut eval = Evaluation::default();
            eval.move_to(&model, Touch::Toe, &state.q, &state.v);
            eval.inertias.update(&model, &eval.kin);
            let (k, p) = eval.inertias.energy(&model, &eval.kin, state.q[1]);
            let ([py, pz], l) = eval.inertias.momentum(&model, &eval.kin);
            [k, p, py, pz, l + state.q[0] * pz - state.q[1] * py]
        };
        let before = measure(&state);
        relabel::swap(&model, &mut eval, &mut state, air, air);
        let after = measure(&state);
        for (a, b) in before.iter().zip(&after) {
            worst = worst.max((a - b).abs() / (1.0 + a.abs()));
        }
        relabel::swap(&model, &mut eval, &mut state, air, air);
        for i in 0..model.n {
            worst = worst
                .max((state.q[i] - q[i]).abs())
                .max((state.v[i] - v[i]).abs());
        }
    }
    // Measured 4.5e-14.
    assert!(worst < 1e-11, "{worst:e}");
}

/// Nor does a swap change how the robot moves on: accelerations are the same, friction of the joints and
/// the controller's torques included, which go on counting the legs as before until the next sample.
#[test]
fn a_swap_keeps_the_accelerations() {
    let body =
        r#""foot": {"damping": 1}, "lower_leg": {"damping": 2}, "upper_leg": {"damping": 3}"#;
    let control = r#""lifting": {"K_p": [100, 200, 3000], "ahead": 0.4, "height": 1.9},
        "feedforward": {}, "arm_swing": {}"#;
    let pd = r#"{"gain": 50, "reference": 0.1, "damping": 5}"#;
    let helpers = format!(
        r#""head_damping": {{"y": 20, "z": 30}}, "hip_pd": {pd}, "free_knee_pd": {pd},
        "knee_stop": {{"stiffness": 500, "damping": 0.1}}"#
    );
    let model = bare(&format!(
        r#"{{"contact": {{"law": "push_only"}}, "body": {{{body}}}, "control": {{{control}}},
            "helpers": {{{helpers}}}, "start": {{"q": {{"q5": 0.5, "q6": -0.8, "q7": 0.3}}}}}}"#
    ));
    let mut state = Simulation::new(model.clone()).expect("a start").state;
    let mut rng = ChaCha8Rng::seed_from_u64(6);
    let mut worst: f64 = 0.0;
    for _ in 0..200 {
        (state.q, state.v) = (draw(&mut rng, model.n, 1.5), draw(&mut rng, model.n, 5.0));
        (state.mode.support, state.mode.free) = (Foot::AIR, Foot::AIR);
        let accelerations = |state: &skate_core::state::State| {
            let mut eval = Evaluation::default();
            let frozen = Frozen::of(&model, state, &[0.0; NV]);
            let done = eval.accelerations(&model, &state.q, &state.v, &frozen);
            done.expect("regular");
            eval.qdd
        };
        let before = accelerations(&state);
        relabel::swap(
            &model,
            &mut Evaluation::default(),
            &mut state,
            Foot::AIR,
            Foot::AIR,
        );
        let mut after = accelerations(&state);
        relabel::reverse_legs(&mut after);
        let size = before.iter().fold(1.0, |top: f64, x| top.max(x.abs()));
        for c in 3..model.n {
            worst = worst.max((before[c] - after[c]).abs() / size);
        }
    }
    // Measured 2e-13.
    assert!(worst < 1e-11, "{worst:e}");
}

/// In flight without damping energy and momenta stay, gravity's share taken out.
#[test]
fn flight_conserves_energy_and_momenta() {
    let links = [
        "head",
        "upper_body",
        "middle_body",
        "lower_body",
        "upper_arm",
        "lower_arm",
        "hand",
        "upper_leg",
        "lower_leg",
        "foot",
    ];
    let free: Vec<String> = links
        .iter()
        .map(|l| format!(r#""{l}": {{"damping": 0}}"#))
        .collect();
    for gravity in [9.81, 0.0] {
        // The trunk's joints out of the plane would let the plane's reaction act on the momenta.
        let scene = format!(
            r#"{{"accuracy": 1e-11, "locked": ["q8", "q10"], "body": {{{}}},
                "ice": {{"gravity": {gravity}}},
                "contact": {{"law": "push_only"}}, "fall": {{"head_height": -10}},
                "start": {{"q": {{"z0": 30, "q2": 0.4, "q3": -0.3, "q5": -0.2, "q6": -0.3, "q11": 0.5}},
                "v": {{"z0": 11, "y0": 1, "q1": 0.5, "q2": -2, "q5": 3, "q6": 2, "q11": 4, "q17": 2}}}}}}"#,
            free.join(",")
        );
        let mut sim = Simulation::new(bare(&scene)).expect("a start");
        let measure = |sim: &Simulation| {
            let eval = sim.survey();
            let (k, p) = eval.inertias.energy(&sim.model, &eval.kin, sim.state.q[1]);
            let ([py, pz], l) = eval.inertias.momentum(&sim.model, &eval.kin);
            [k + p, py, pz, l + sim.state.q[0] * pz - sim.state.q[1] * py]
        };
        let start = measure(&sim);
        sim.advance(2.0);
        assert_eq!(sim.ended, None);
        let mut end = measure(&sim);
        end[2] += sim.model.mass() * gravity * 2.0;
        // Gravity turns the body about the world's origin; without it that momentum stays too.
        let kept = if gravity > 0.0 { 3 } else { 4 };
        for i in 0..kept {
            // Measured at most 6e-13.
            assert!(
                (end[i] / start[i] - 1.0).abs() < 1e-9,
                "{i}: {start:?} {end:?}"
            );
        }
    }
}

/// A body that its joints hold rigid stops after v^2 / (2 mu g), and after v / (mu g) seconds.
#[test]
fn sliding_to_rest_has_its_closed_form() {
    for (speed, mu) in [(1.0_f64, 0.2), (-1.0, 0.9)] {
        for capture in [0.0, 0.01] {
            let scene = format!(
                r#"{{{LOCKED}, "accuracy": "reference", "ice": {{"friction": {{"capture_speed": {capture}}}}},
                    "start": {{"q": {{"q5": 0.5, "q6": -0.8, "q7": 0.3}}, "v": {{"y0": {speed}}}}}}}"#
            );
            let mut sim = Simulation::new(bare(&scene)).expect("a start");
            // The torques that inverse dynamics gives for a body decelerating as one piece hold it.
            let n = sim.model.n;
            let deceleration = -speed.signum() * mu * 9.81;
            let mut qdd = [0.0; NV];
            qdd[0] = deceleration;
            let mut tau = [0.0; NV];
            let eval = sim.survey();
            eval.inertias
                .inverse_dynamics(&sim.model, &eval.kin, &qdd, &mut tau);
            sim.hold(&tau[3..n]);
            let inertia = sim.eval.problem.S[(0, 0)];
            let until = (speed.abs() - capture) / (mu * 9.81);
            sim.advance(until - 1e-6);
            assert_eq!(sim.state.mode.number(), 3);
            let mut stop = None;
            let begin = sim.state.t;
            while stop.is_none() && sim.state.t < begin + 1e-4 {
                let next = sim.state.t + 1e-5;
                sim.advance(next);
                stop = sim
                    .take_events()
                    .iter()
                    .find(|e| e.to.number() == 1)
                    .map(|e| e.t);
            }
            let t = stop.expect("it stops");
            // Measured 7e-14 s, 8e-15 m.
            assert!((t - until).abs() < 1e-9, "{t} {until}");
            let way = (speed * speed - capture * capture) / (2.0 * mu * 9.81);
            assert!(
                (sim.state.q[0].abs() - way).abs() < 1e-9,
                "{} {way}",
                sim.state.q[0]
            );
            // The foot alone is stopped; the joints let the rest go on: S is the inertia felt there.
            let taken = 0.5 * inertia * capture * capture;
            assert!(
                (sim.state.ledger.capture - taken).abs() < 1e-9,
                "{:?}",
                sim.state.ledger
            );
        }
    }
}

/// Kinetic and potential energy change by what the ledger books, impacts and friction included.
#[test]
fn the_energy_balance_closes() {
    let text = include_str!("../../../skate_env/scenes/paper.toml");
    let mut scene = Scene::from_toml(text).expect("the preset");
    scene.accuracy = skate_core::scene::Accuracy::Tolerance(1e-11);
    let mut sim = Simulation::new(Model::compile(&scene).expect("a model")).expect("a start");
    let energy = |sim: &Simulation| {
        let eval = sim.survey();
        let (k, p) = eval.inertias.energy(&sim.model, &eval.kin, sim.state.q[1]);
        k + p
    };
    let start = energy(&sim);
    let mut largest: f64 = 0.0;
    while sim.state.t < 2.5 {
        let next = sim.state.t + 0.01;
        sim.advance(next);
        let l = sim.state.ledger;
        let booked = l.actuators - l.damping - l.friction - l.impacts - l.capture;
        largest = largest.max((energy(&sim) - start - booked).abs());
    }
    assert_eq!(sim.ended, None);
    // Measured 2.2e-9 J; the largest kinetic energy is about 1,000 J.
    assert!(largest < 1e-7, "{largest:e}");
}

/// Continuing from a snapshot is the same motion, bit for bit.
#[test]
fn a_snapshot_continues_bit_for_bit() {
    let text = include_str!("../../../skate_env/scenes/paper.toml");
    let model = Model::compile(&Scene::from_toml(text).expect("the preset")).expect("a model");
    let mut sim = Simulation::new(model).expect("a start");
    sim.advance(0.5);
    let saved = sim.snapshot();
    let mut other = Simulation::new(sim.model.clone()).expect("a start");
    other.restore(&saved).expect("a snapshot");
    for sim in [&mut sim, &mut other] {
        sim.advance(2.0);
    }
    assert_eq!(sim.state, other.state);
    for cut in [0, 5, saved.len() / 2, saved.len() - 1] {
        assert!(other.restore(&saved[..cut]).is_err());
    }
    assert_eq!(sim.state, other.state);
}

struct Pendulum;

impl Flow<2> for Pendulum {
    fn rhs(
        &mut self,
        _: f64,
        y: &[f64; 2],
        dy: &mut [f64; 2],
    ) -> Result<(), skate_core::error::EndCause> {
        *dy = [y[1], -y[0].sin()];
        Ok(())
    }
}

/// The pair converges with order 5, its dense output with order 4, within 0.25.
#[test]
fn the_method_has_its_order() {
    let run = |steps: u32| {
        let h = 1.0 / f64::from(steps);
        let mut y = [1.0, 0.5];
        let mut step = Step::new(&[1.0, 1.0]);
        let mut middle = y;
        for i in 0..steps {
            let mut dy = [0.0; 2];
            Pendulum.rhs(0.0, &y, &mut dy).expect("smooth");
            step.attempt(&mut Pendulum, (0.0, &y, &dy), h)
                .expect("smooth");
            if i == steps / 2 {
                step.make_dense();
                middle = step.at(0.5);
            }
            y = step.y1;
        }
        (y, middle)
    };
    let (exact, _) = run(4096);
    let error = |n: u32| (run(n).0[0] - exact[0]).abs();
    let order = (error(8) / error(32)).log2() / 2.0;
    assert!((order - 5.0).abs() < 0.25, "{order}");
    let dense = |n: u32| {
        let h = 1.0 / f64::from(n);
        let fine = {
            let mut y = [1.0, 0.5];
            let mut step = Step::new(&[1.0, 1.0]);
            let count = 4096;
            let h = (0.5 + 0.5 * h) / f64::from(count);
            for _ in 0..count {
                let mut dy = [0.0; 2];
                Pendulum.rhs(0.0, &y, &mut dy).expect("smooth");
                step.attempt(&mut Pendulum, (0.0, &y, &dy), h)
                    .expect("smooth");
                y = step.y1;
            }
            y
        };
        (run(n).1[0] - fine[0]).abs()
    };
    let order = (dense(8) / dense(32)).log2() / 2.0;
    // The continuous extension's local error is of order 5; it falls at least that fast.
    assert!(order > 3.75, "{order}");
}
