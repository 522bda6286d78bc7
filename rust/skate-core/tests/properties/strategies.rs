//! Strategies.

use proptest::{
    prelude::*,
    test_runner::{Config, RngSeed},
};
use skate_core::{
    model::{
        Model,
        layout::{NV, ROOT},
    },
    scene::{Friction, Scene, effects::EFFECTS},
    sim::Simulation,
};

/// Number of cases, with a fixed seed.
pub fn config(cases: u32) -> Config {
    Config {
        cases,
        rng_seed: RngSeed::Fixed(7),
        failure_persistence: None,
        ..Config::default()
    }
}

const PRESETS: [&str; 7] = [
    include_str!("../../../../skate_env/scenes/paper_printed.toml"),
    include_str!("../../../../skate_env/studies/scenes/paper_damped.toml"),
    include_str!("../../../../skate_env/scenes/paper_arms.toml"),
    include_str!("../../../../skate_env/studies/scenes/blade.toml"),
    include_str!("../../../../skate_env/scenes/push_only.toml"),
    include_str!("../../../../skate_env/scenes/paper.toml"),
    "[start.q]\nq2 = 0.1\nq3 = -0.2\nq5 = 0.5\nq6 = -0.9\nq7 = 0.4\n[start.v]\ny0 = 1.0",
];

/// A preset with some effects toggled, at a given accuracy.
pub fn scene(accuracies: &'static [&'static str]) -> impl Strategy<Value = Scene> {
    let effects = prop::collection::vec(0..EFFECTS.len(), 0..4);
    let accuracy = prop::sample::select(accuracies);
    (0..PRESETS.len(), effects, accuracy).prop_filter_map(
        "starts",
        |(preset, effects, accuracy)| {
            let mut scene = Scene::from_toml(PRESETS[preset]).expect("a known scene");
            scene.accuracy = serde_json::from_str(accuracy).expect("an accuracy");
            for effect in effects {
                let effect = &EFFECTS[effect];
                let switched = match effect.is_on(&scene) {
                    true => scene.without(effect.name),
                    false => scene.with(effect.name),
                };
                scene = switched.unwrap_or(scene);
            }
            // Without slipping a start may have no motion.
            Simulation::new(Model::compile(&scene).ok()?)
                .is_ok()
                .then_some(scene)
        },
    )
}

pub fn simulation(scene: &Scene) -> Simulation {
    Simulation::new(Model::compile(scene).expect("a model")).expect("a start")
}

/// One entry per coordinate, in [-size, size].
pub fn vector(size: f64) -> impl Strategy<Value = [f64; NV]> {
    prop::array::uniform19(-size..size)
}

/// Torques of all magnitudes [N m].
pub fn torque() -> impl Strategy<Value = [f64; NV]> {
    let size = prop::sample::select(&[0.0, 1.0, 30.0, 200.0]);
    (vector(1.0), size).prop_map(|(shares, size)| shares.map(|x| size * x))
}

/// Dry friction on either foot, from small values to those at which the Painleve paradox is common.
pub fn friction() -> impl Strategy<Value = Friction> {
    (0.0..1.5, 0.0..1.5).prop_map(|(mu_forward, mu_backward)| Friction::Directional {
        mu_forward,
        mu_backward,
        capture_speed: 0.01,
    })
}

/// Hold torques that are given for all coordinates.
pub fn hold(sim: &mut Simulation, torque: &[f64; NV]) {
    let joints = sim.model.n - ROOT;
    sim.hold(&torque[..joints]);
}
