//! Impacts of models with locked joints.

use super::{compare::translate, pairs::PAIRS};
use nalgebra::DMatrix;
use rand::{Rng, SeedableRng};
use rand_chacha::ChaCha8Rng;
use skate_core::{
    model::{
        Model,
        contact_mode::{ContactMode, Foot, SoleContact},
        friction::FrictionMode,
        layout::NV,
    },
    rhs::Evaluation,
    scene::Scene,
};

/// Velocities per impulse on both feet, (supporting, free) x (y, z, rotation), which determine an impact.
/// Computed from M of all coordinates with the rows of `held` removed.
fn contact_response(model: &Model, q: &[f64; NV], held: &[&str]) -> DMatrix<f64> {
    let free: Vec<usize> = (0..model.n)
        .filter(|&c| !held.contains(&model.names[c]))
        .collect();
    let mut eval = Evaluation::default();
    eval.full_kinematics(model, SoleContact::Toe, q, &[0.0; NV]);
    let M = eval.inertias.crba(model, &eval.kin);
    let M = M.select_rows(&free).select_columns(&free);
    let mut J = DMatrix::zeros(6, free.len());
    for (column, &c) in free.iter().enumerate() {
        let mut unit = [0.0; NV];
        unit[c] = 1.0;
        let mode = flat_feet();
        eval.set_planar_configuration(model, mode, q, &unit);
        for i in 0..3 {
            J[(i, column)] = if c == i { 1.0 } else { 0.0 };
            J[(3 + i, column)] = eval.point_velocity[i];
        }
    }
    &J * M
        .lu()
        .solve(&J.transpose())
        .expect("M is positive definite")
}

fn flat_feet() -> ContactMode {
    let foot = Foot::new(SoleContact::Flat, FrictionMode::Forward);
    ContactMode {
        support: foot,
        free: foot,
    }
}

/// Locked joints are rigid during impacts.
#[test]
fn locked_joints_are_rigid_in_impacts() {
    let mut rng = ChaCha8Rng::seed_from_u64(13);
    let whole = Model::compile(&Scene::default()).expect("valid");
    let mut worst: f64 = 0.0;
    for pair in PAIRS.iter().filter(|pair| !pair.joints.is_empty()) {
        let scene = Scene {
            locked: pair.joints.iter().map(|&joint| joint.into()).collect(),
            ..Scene::default()
        };
        let model = Model::compile(&scene).expect("valid");
        for _ in 0..20 {
            let q: [f64; NV] = std::array::from_fn(|_| rng.random_range(-1.0..1.0));
            let q = translate(&model, &model, &q);
            let mut eval = Evaluation::default();
            eval.set_configuration(&model, SoleContact::Toe, &q, &[0.0; NV]);
            eval.assemble(&model, SoleContact::Flat);
            let (S, G, W) = (
                eval.factored.problem.S,
                eval.factored.problem.G,
                eval.factored.problem.W,
            );
            let inverse = S.try_inverse().expect("S is positive definite");
            let cross = G * inverse;
            let own = cross * G.transpose() + W;
            let expected = contact_response(&whole, &translate(&model, &whole, &q), pair.joints);
            let size = expected.amax();
            for i in 0..3 {
                for j in 0..3 {
                    let apart = [
                        inverse[(i, j)] - expected[(i, j)],
                        cross[(i, j)] - expected[(3 + i, j)],
                        own[(i, j)] - expected[(3 + i, 3 + j)],
                    ];
                    worst = apart.iter().fold(worst, |top, x| top.max(x.abs() / size));
                }
            }
        }
    }
    // Measured 2e-12, the rounding of the dense solution.
    assert!(worst < 1e-11, "{worst:e}");
}
