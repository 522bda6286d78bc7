//! The sole points, from which observations and rewards are computed, are always those of the present
//! state.

mod presets;

use presets::PRESETS;
use rand::{Rng, SeedableRng, seq::IndexedRandom};
use rand_chacha::ChaCha8Rng;
use skate_core::{
    model::{
        Model,
        layout::{NV, ROOT},
    },
    rhs::{Evaluation, sole_points::SolePoints},
    scene::{Friction, Scene},
    sim::Simulation,
};

const ACCURACIES: [&str; 3] = [
    r#""fast""#,
    r#""balanced""#,
    r#"{"method": "rosenbrock", "tolerance": 1e-3}"#,
];

/// Sole points recomputed from the state.
fn recomputed(sim: &Simulation) -> SolePoints {
    let (model, state) = (&sim.model, &sim.state);
    let mut eval = Evaluation::default();
    eval.set_configuration(model, state.mode.support.touch, &state.q, &state.v);
    let points = SolePoints::of_one(model, &eval.kin, state.mode, state.q[1]);
    // Time steps carry the centre of mass from step to step.
    let centre = sim.sole_points.centre;
    SolePoints { centre, ..points }
}

#[test]
fn sole_points_agree_with_the_final_state() {
    let mut rng = ChaCha8Rng::seed_from_u64(10);
    let mut ends = std::collections::BTreeMap::new();
    for preset in PRESETS {
        for accuracy in ACCURACIES {
            let mut scene = Scene::from_toml(preset).expect("the preset");
            scene.accuracy = serde_json::from_str(accuracy).expect("an accuracy");
            // Without a fall condition and with blocking feet, the run continues until no motion is
            // possible.
            scene.fall = None;
            scene.ice.friction = Friction::Coulomb {
                mu: 2.0,
                capture_speed: 0.01,
            };
            let model = Model::compile(&scene).expect("a model");
            let n = model.n - ROOT;
            let start = Simulation::new(model).expect("a start");
            // Of the runs of this preset about one in 150 jams or overflows, of the others hardly any.
            let runs = if scene.name == "paper_printed" {
                160
            } else {
                40
            };
            for _ in 0..runs {
                let mut sim = start.clone();
                let size = *[30.0, 300.0, 1e3, 3e3, 1e4, 3e6]
                    .choose(&mut rng)
                    .expect("some");
                for _ in 0..60 {
                    let torque: [f64; NV] =
                        std::array::from_fn(|_| size * rng.random_range(-1.0..1.0));
                    if rng.random_bool(0.1) {
                        sim.kick(rng.random_range(-10.0..10.0))
                            .expect("a foot that slides");
                    }
                    sim.hold(&torque[..n]);
                    assert_eq!(
                        format!("{:?}", sim.sole_points),
                        format!("{:?}", recomputed(&sim))
                    );
                    let until = sim.next_action_time();
                    sim.advance(until);
                    assert_eq!(
                        format!("{:?}", sim.sole_points),
                        format!("{:?}", recomputed(&sim)),
                        "{accuracy}: {:?}",
                        sim.ended
                    );
                    let bytes = sim.snapshot();
                    let mut other = start.clone();
                    other.restore(&bytes).expect("a snapshot");
                    assert_eq!(
                        format!("{:?}", other.sole_points),
                        format!("{:?}", recomputed(&sim))
                    );
                    if sim.ended.is_some() {
                        break;
                    }
                }
                let end = sim.ended.map_or("none", |end| end.name());
                *ends.entry(end).or_insert(0) += 1;
            }
        }
    }
    // Measured with seeds 10 to 15: 3 to 5 runs whose last step was abandoned, of 1,080.
    println!("{ends:?}");
    let abandoned = ["jam", "not_finite"]
        .iter()
        .any(|end| ends.contains_key(end));
    assert!(
        abandoned && ends.contains_key("none") && ends.contains_key("step_limit"),
        "{ends:?}"
    );
}
