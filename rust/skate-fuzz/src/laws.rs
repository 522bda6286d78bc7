//! What holds whatever somebody does.

use skate_core::{scene::Scene, sim::Simulation};

/// A scene written and read is the same scene.
pub fn scene_survives_text(scene: &Scene) {
    assert_eq!(Scene::from_toml(&scene.to_toml()).as_ref(), Ok(scene));
    assert_eq!(Scene::from_json(&scene.to_json()).as_ref(), Ok(scene));
}

/// The state is made of numbers, whether or not the simulation has ended.
pub fn sound(sim: &Simulation) {
    let state = &sim.state;
    assert!(state.t.is_finite() && state.t >= 0.0, "t = {}", state.t);
    finite("q", &state.q);
    finite("v", &state.v);
    let ledger = &state.ledger;
    let taken = [
        ledger.damping,
        ledger.friction,
        ledger.impacts,
        ledger.capture,
    ];
    finite("ledger", &taken);
    finite("ledger", &[ledger.start, ledger.actuators]);
    if sim.ended.is_none() {
        finite("accelerations", &sim.eval.qdd[..sim.model.n]);
        assert!(
            sim.model.modes().contains(&unpulled(sim)),
            "{:?} in {:?} on {:?}",
            state.mode,
            sim.model.scene.contact,
            sim.model.scene.ice
        );
    }
}

/// The mode without what only forces decide.
fn unpulled(sim: &Simulation) -> skate_core::contact::Mode {
    let mut mode = sim.state.mode;
    (mode.support.pulled, mode.free.pulled) = (false, false);
    mode
}

pub fn finite(what: &str, x: &[f64]) {
    assert!(x.iter().all(|x| x.is_finite()), "{what}: {x:?}");
}

/// Evaluations that one step may take in the mean: some tens, and more where a step is tried again and
/// again or an event located.
const EVALUATIONS: u64 = 200;

/// Most evaluations of an advance by `time`: `sim/step.rs` promises at most 2,000 steps within any
/// millisecond that begins with a step.
pub fn most_evaluations(time: f64) -> u64 {
    const STEPS: u64 = 2_000;
    let windows = (time / 1e-3).ceil() as u64 + 1;
    windows * STEPS * EVALUATIONS
}
