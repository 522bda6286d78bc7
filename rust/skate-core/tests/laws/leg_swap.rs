//! A leg swap renames the coordinates and does not change the motion.

use super::{bare, draw};
use rand::SeedableRng;
use rand_chacha::ChaCha8Rng;
use skate_core::{
    dynamics::bias_forces,
    events::leg_swap,
    model::{
        contact_mode::{ContactMode, Foot, SoleContact},
        layout::NV,
    },
    rhs::{Evaluation, StepContext},
    sim::Simulation,
};

/// A swap conserves energy and momentum and is its own inverse.
#[test]
fn a_swap_conserves_energy_and_momentum_and_is_an_involution() {
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
        state.mode = ContactMode {
            support: air,
            free: air,
        };
        let (q, v) = (state.q, state.v);
        let mut eval = Evaluation::default();
        let measure = |state: &skate_core::model::state::State| {
            let mut eval = Evaluation::default();
            eval.set_configuration(&model, SoleContact::Toe, &state.q, &state.v);
            eval.inertias.update(&model, &eval.kin);
            let (k, p) = bias_forces::energy(&model, &eval.kin, &state.v, state.q[1]);
            let ([py, pz], l) = eval.inertias.momentum(&model, &eval.kin);
            [k, p, py, pz, l + state.q[0] * pz - state.q[1] * py]
        };
        let before = measure(&state);
        leg_swap::swap(&model, &mut eval, &mut state, air, air);
        let after = measure(&state);
        for (a, b) in before.iter().zip(&after) {
            worst = worst.max((a - b).abs() / (1.0 + a.abs()));
        }
        leg_swap::swap(&model, &mut eval, &mut state, air, air);
        for i in 0..model.n {
            worst = worst
                .max((state.q[i] - q[i]).abs())
                .max((state.v[i] - v[i]).abs());
        }
    }
    // Measured 4.5e-14.
    assert!(worst < 1e-11, "{worst:e}");
}

/// A swap does not change the accelerations, including joint friction and the controller's torques; the
/// controller numbers the legs as before until its next sample.
#[test]
fn a_swap_does_not_change_accelerations() {
    let body =
        r#""foot": {"damping": 1}, "lower_leg": {"damping": 2}, "upper_leg": {"damping": 3}"#;
    let control = r#""lifting": {"K_p": [100, 200, 3000], "ahead": 0.4, "height": 1.9},
        "feedforward": {}, "arm_swing": {}"#;
    let pd = r#"{"gain": 50, "reference": 0.1, "damping": 5}"#;
    let stabilizers = format!(
        r#""head_damping": {{"y": 20, "z": 30}}, "hip_pd": {pd}, "free_knee_pd": {pd},
        "knee_stop": {{"stiffness": 500, "damping": 0.1}}"#
    );
    let model = bare(&format!(
        r#"{{"contact": {{"law": "push_only"}}, "body": {{{body}}}, "control": {{{control}}},
            "stabilizers": {{{stabilizers}}}, "start": {{"q": {{"q5": 0.5, "q6": -0.8, "q7": 0.3}}}}}}"#
    ));
    let mut state = Simulation::new(model.clone()).expect("a start").state;
    let mut rng = ChaCha8Rng::seed_from_u64(6);
    let mut worst: f64 = 0.0;
    for _ in 0..200 {
        (state.q, state.v) = (draw(&mut rng, model.n, 1.5), draw(&mut rng, model.n, 5.0));
        (state.mode.support, state.mode.free) = (Foot::AIR, Foot::AIR);
        let accelerations = |state: &skate_core::model::state::State| {
            let mut eval = Evaluation::default();
            let frozen = StepContext::of(&model, state, &[0.0; NV]);
            let done = eval.accelerations(&model, &state.q, &state.v, &frozen);
            done.expect("regular");
            eval.qdd
        };
        let before = accelerations(&state);
        leg_swap::swap(
            &model,
            &mut Evaluation::default(),
            &mut state,
            Foot::AIR,
            Foot::AIR,
        );
        let mut after = accelerations(&state);
        skate_core::model::layout::reverse_legs(&mut after);
        let size = before.iter().fold(1.0, |top: f64, x| top.max(x.abs()));
        for c in 3..model.n {
            worst = worst.max((before[c] - after[c]).abs() / size);
        }
    }
    // Measured 2e-13.
    assert!(worst < 1e-11, "{worst:e}");
}
