//! Properties that hold after any sequence of calls.

use skate_core::{
    model::Model,
    scene::Scene,
    sim::{self, Simulation},
};

/// Writing and reading a scene gives the same scene.
pub fn scene_survives_text(scene: &Scene) {
    assert_eq!(Scene::from_toml(&scene.to_toml()).as_ref(), Ok(scene));
    assert_eq!(Scene::from_json(&scene.to_json()).as_ref(), Ok(scene));
}

/// The state is finite, also after termination.
pub fn assert_finite(sim: &Simulation) {
    let state = &sim.state;
    assert!(state.t.is_finite() && state.t >= 0.0, "t = {}", state.t);
    finite("q", &state.q);
    finite("v", &state.v);
    let energy_balance = &state.energy_balance;
    let taken = [
        energy_balance.damping,
        energy_balance.friction,
        energy_balance.impacts,
        energy_balance.capture,
    ];
    finite("energy_balance", &taken);
    finite(
        "energy_balance",
        &[
            energy_balance.start,
            energy_balance.actuators,
            energy_balance.kicks,
        ],
    );
    if sim.ended.is_none() {
        finite("accelerations", &sim.eval.qdd[..sim.model.n]);
        assert!(
            sim.model.modes().contains(&mode_without_pull(sim)),
            "{:?} in {:?} on {:?}",
            state.mode,
            sim.model.scene.contact,
            sim.model.scene.ice
        );
    }
}

/// The mode without the flags that depend on forces only.
fn mode_without_pull(sim: &Simulation) -> skate_core::model::contact_mode::ContactMode {
    let mut mode = sim.state.mode;
    (mode.support.pulled, mode.free.pulled) = (false, false);
    mode
}

pub fn finite(what: &str, x: &[f64]) {
    assert!(x.iter().all(|x| x.is_finite()), "{what}: {x:?}");
}

/// Evaluations of the last step beyond the budget: it may be repeated many times, and several events may be
/// located within it.
const LAST_STEP: f64 = 2000.0;

/// Upper bound on the evaluations of an advance by `time` [s].
pub fn most_evaluations(model: &Model, time: f64) -> u64 {
    (sim::most_evaluations(model.usual_rate, time) + LAST_STEP) as u64
}
