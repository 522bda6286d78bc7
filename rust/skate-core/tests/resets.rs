//! Tentative resets: a refused reset changes nothing, and drawn parameters give the same model as the
//! scene's text.

mod presets;

use presets::PRESETS;
use skate_core::{
    batch::{Autoreset, Batch},
    model::{Model, layout::NV},
    scene::Scene,
    sim::Simulation,
    task::{Start, StateOverride, Task, Weights},
};

const ACCURACIES: [&str; 2] = [r#""fast""#, r#""balanced""#];

fn scene(preset: &str, accuracy: &str) -> Scene {
    let mut scene = Scene::from_toml(preset).expect("the preset");
    scene.accuracy = serde_json::from_str(accuracy).expect("an accuracy");
    scene
}

fn task(scene: Scene) -> Task {
    Task::new(scene, vec![100.0; 16], Weights::default()).expect("a task")
}

/// All observable data of a simulation, including events and gait steps, in a form that distinguishes -0.0
/// from 0.0.
fn observable(sim: &Simulation) -> String {
    let mut sim = sim.clone();
    let (events, records) = (sim.take_events(), sim.take_records());
    let eval = &sim.eval;
    let forces = eval.loads(&sim.model, sim.state.mode);
    format!(
        "{events:?} {records:?} {:?} {:?} {forces:?} {:?} {:?}",
        eval.tau,
        eval.qdd,
        sim.head(),
        sim.snapshot()
    )
}

/// Below the ice.
fn below_the_ice() -> StateOverride {
    let mut q = [0.0; NV];
    q[1] = -3.0;
    StateOverride {
        q: Some(q),
        ..StateOverride::default()
    }
}

#[test]
fn a_refused_reset_changes_nothing() {
    for preset in PRESETS {
        for accuracy in ACCURACIES {
            let model = Model::compile(&scene(preset, accuracy)).expect("a model");
            let mut sim = Simulation::new(model).expect("a start");
            let start = (sim.state.q, sim.state.v, sim.state.support_leg);
            let mut events = 0;
            for _ in 0..60 {
                sim.hold(&[3.0; 16]);
                sim.advance(sim.next_action_time());
                let before = observable(&sim);
                let mut q = start.0;
                q[1] = -3.0;
                sim.reset(&q, &start.1, start.2).expect_err("below the ice");
                q[1] = f64::NAN;
                sim.reset(&q, &start.1, start.2).expect_err("nowhere");
                assert!(
                    observable(&sim) == before,
                    "{accuracy} at {} s",
                    sim.state.t
                );
                events = sim.clone().take_events().len();
            }
            assert!(events > 0);
            sim.reset(&start.0, &start.1, start.2).expect("as before");
            assert!(sim.take_events().len() < events);
        }
    }
}

/// If one start of a batch is refused, no episode changes, including random number generators and gait
/// steps.
#[test]
fn a_refused_batch_reset_changes_nothing() {
    let mut drawn = scene(PRESETS[1], ACCURACIES[0]);
    drawn.randomise = [("body.head.mass".to_owned(), [4.0, 5.0])].into();
    let task = Task {
        perturb: 0.01,
        ..task(drawn)
    };
    let n = 7;
    for threads in [1, 3] {
        let mut batch =
            Batch::new(task.clone(), n, Autoreset::NextStep, Some(threads)).expect("a batch");
        let start = |i: usize| Start {
            seed: Some(i as u64),
            ..Start::default()
        };
        let starts: Vec<_> = (0..n).map(|i| (i, start(i))).collect();
        batch.reset(&starts, &|| true).expect("starts");
        let mut observations = vec![0.0; n * task.observation.len()];
        let mut outcomes: Vec<_> = batch.episodes.iter().map(|e| (e.result(), None)).collect();
        let actions = vec![0.1; n * task.joints()];
        for _ in 0..20 {
            let stepped = batch.step(&actions, &mut observations, &mut outcomes, &|| true);
            stepped.expect("starts");
        }
        let all = |batch: &Batch| -> Vec<_> {
            let each = batch.episodes.iter();
            each.map(|e| (e.snapshot(), observable(&e.sim))).collect()
        };
        let before = all(&batch);
        let mut refused = starts.clone();
        refused[4].1.state = below_the_ice();
        let why = batch
            .reset(&refused, &|| true)
            .expect_err("one is below the ice");
        assert!(why.0.contains("below the ice"), "{why}");
        assert!(all(&batch) == before);
        // If an index occurs twice, the last start counts.
        batch
            .reset(&[refused[4].clone(), starts[4].clone()], &|| true)
            .expect("a start");
        let after = all(&batch);
        assert!((0..n).all(|i| (after[i] == before[i]) == (i != 4)));
    }
}

/// A model built from drawn parameters equals the model compiled from the scene's text.
#[test]
fn drawn_parameters_give_the_model_of_the_scene() {
    for preset in PRESETS {
        let mut drawn = scene(preset, ACCURACIES[0]);
        let may = [
            "body.",
            "ice.",
            "control.lifting",
            "control.feedforward",
            "stabilizers.",
        ];
        for number in drawn.parameters() {
            if may.iter().any(|table| number.name.starts_with(table)) {
                let (x, by) = (number.value, 0.01 * number.value.abs());
                drawn.randomise.insert(number.name, [x - by, x + by]);
            }
        }
        drawn.validate().expect("ranges");
        let task = Task {
            perturb: 0.01,
            ..task(drawn.clone())
        };
        let mut batch = Batch::new(task, 1, Autoreset::NextStep, Some(1)).expect("a batch");
        let mut last = batch.episodes[0].clone();
        for seed in 0..20 {
            let start = Start {
                seed: Some(seed),
                ..Start::default()
            };
            batch.reset(&[(0, start)], &|| true).expect("a start");
            let sim = &batch.episodes[0].sim;
            let scene = &sim.model.scene;
            assert!(*scene != drawn);
            for number in scene.parameters() {
                if let Some([low, high]) = drawn.randomise.get(&number.name) {
                    assert!((*low..=*high).contains(&number.value), "{}", number.name);
                }
            }
            let text = Scene::from_json(&scene.to_json()).expect("a valid scene");
            let model = Model::compile(&text).expect("a model");
            assert_eq!(format!("{model:?}"), format!("{:?}", sim.model));
            let mut other = Simulation::new(model).expect("a start");
            let state = &sim.state;
            other
                .reset(&state.q, &state.v, state.support_leg)
                .expect("the same start");
            assert!(other.snapshot() == sim.snapshot());
            // `set_model` on an episode with other parameters gives the same model.
            let mut twin = last.clone();
            twin.restore(&batch.episodes[0].snapshot())
                .expect("the same scene");
            assert_eq!(format!("{:?}", twin.sim.model), format!("{:?}", sim.model));
            assert!(twin.snapshot() == batch.episodes[0].snapshot());
            last.clone_from(&batch.episodes[0]);
        }
    }
}
