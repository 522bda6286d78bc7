//! Episodes in SIMD lanes equal single episodes bit for bit, for every width, batch size and number of
//! threads.

mod presets;

use presets::PRESETS;
use rand::{Rng, SeedableRng};
use rand_chacha::ChaCha8Rng;
use skate_core::{
    batch::{Autoreset, Batch, Outcome},
    model::{Model, layout::ROOT},
    numeric::simd::Width,
    scene::Scene,
    task::{Episode, Start, Task, Weights},
};

const ACTIONS: usize = 150;
/// Steps between located events, in lanes.
const LOCATED: &str = r#"{"method": "dop853", "tolerance": 3e-5}"#;

fn task(scene: &Scene, limit: u64) -> Task {
    let joints = Model::compile(scene).expect("a model").n - ROOT;
    let mut task =
        Task::new(scene.clone(), vec![30.0; joints], Weights::default()).expect("a task");
    (task.perturb, task.limit) = (0.05, Some(limit));
    task
}

/// Observations and outcomes of all actions and the final snapshot, for each of `n` episodes.
fn run(task: &Task, n: usize, threads: usize, lanes: Width) -> Vec<(Vec<u32>, Vec<u8>)> {
    let mut batch =
        Batch::new(task.clone(), n, Autoreset::SameStep, Some(threads)).expect("a batch");
    batch.lanes = lanes;
    let start = |i| Start {
        seed: Some(i as u64),
        ..Start::default()
    };
    let starts: Vec<_> = (0..n).map(|i| (i, start(i))).collect();
    batch.reset(&starts, &|| true).expect("starts");
    let (joints, width) = (task.joints(), task.observation.len());
    let mut random: Vec<_> = (0..n)
        .map(|i| ChaCha8Rng::seed_from_u64(1000 + i as u64))
        .collect();
    let mut observations = vec![0.0; n * width];
    let mut outcomes: Vec<Outcome> = batch.episodes.iter().map(|e| (e.result(), None)).collect();
    let mut seen = vec![Vec::new(); n];
    for _ in 0..ACTIONS {
        let actions: Vec<f64> = random
            .iter_mut()
            .flat_map(|random| {
                (0..joints)
                    .map(|_| random.random_range(-1.0..1.0))
                    .collect::<Vec<_>>()
            })
            .collect();
        batch
            .step(&actions, &mut observations, &mut outcomes, &|| true)
            .expect("steps");
        for (i, seen) in seen.iter_mut().enumerate() {
            let own = &observations[i * width..(i + 1) * width];
            seen.extend(own.iter().map(|x| x.to_bits()));
            let (row, last) = &outcomes[i];
            seen.extend(format!("{row:?} {last:?}").bytes().map(u32::from));
        }
    }
    let snapshots = batch.episodes.iter().map(|episode| episode.snapshot());
    seen.into_iter().zip(snapshots).collect()
}

fn check(scene: &Scene) {
    let task = task(scene, 60);
    // More than one batch of lanes, and not a multiple of any width.
    let n = 75;
    let alone = run(&task, n, 1, Width::One);
    for lanes in Width::all() {
        for threads in [1, 2] {
            let together = run(&task, n, threads, lanes);
            for (i, (one, other)) in alone.iter().zip(&together).enumerate() {
                assert!(
                    one == other,
                    "episode {i}, {lanes:?} lanes, {threads} threads"
                );
            }
        }
        // With another batch size, other episodes share the registers.
        let few = run(&task, 13, 1, lanes);
        assert!(few[..] == alone[..13], "{lanes:?} lanes, 13 episodes");
    }
}

#[test]
fn lanes_do_not_change_a_bit() {
    for (i, preset) in PRESETS.into_iter().enumerate() {
        // Located events take longer: one scene of two-way and one of push-only contact.
        let located = [0, 4].contains(&i).then_some(LOCATED);
        let stepped = [r#""fast""#, r#"{"method": "moreau", "step": 0.001}"#];
        for accuracy in stepped.into_iter().chain(located) {
            let mut scene = Scene::from_toml(preset).expect("the preset");
            scene.accuracy = serde_json::from_str(accuracy).expect("an accuracy");
            check(&scene);
        }
    }
}

/// Actions of 50 ms make episodes long enough for more than one kick.
#[test]
fn lanes_do_not_change_kicks() {
    let mut scene = Scene::from_toml(PRESETS[1]).expect("the preset");
    scene.accuracy = serde_json::from_str(r#""fast""#).expect("an accuracy");
    scene.control.action_period = 0.05;
    let mut task = task(&scene, 1000);
    (task.perturb, task.trunk_noise, task.kick) = (0.01, 0.02, 0.3);
    task.scale.fill(1.0);
    let n = 21;
    let alone = run(&task, n, 1, Width::One);
    for lanes in Width::all() {
        let together = run(&task, n, 2, lanes);
        assert!(together == alone, "{lanes:?} lanes");
    }
    let mut episode = Episode::new(&task).expect("an episode");
    let kicked = alone.iter().filter(|(_, snapshot)| {
        episode.restore(snapshot).expect("its own kind");
        episode.sim.state.energy_balance.kicks != 0.0
    });
    // Measured: 19 of 21; the others have just been reset after a fall.
    assert!(kicked.count() > n / 2);
}

#[test]
fn lanes_may_differ_in_parameters() {
    let stepped = PRESETS.map(|preset| (preset, r#""fast""#));
    for (preset, accuracy) in stepped.into_iter().chain([(PRESETS[0], LOCATED)]) {
        let mut scene = Scene::from_toml(preset).expect("the preset");
        scene.accuracy = serde_json::from_str(accuracy).expect("an accuracy");
        let ranges = [
            ("body.upper_leg.mass", [6.5, 8.0]),
            ("body.head.length", [0.2, 0.3]),
            ("body.foot.toe", [0.25, 0.31]),
            ("ice.friction.mu_forward", [0.1, 0.3]),
            ("control.lifting.height", [1.9, 2.1]),
        ];
        for (name, range) in ranges {
            scene.randomise.insert(name.into(), range);
        }
        scene.validate().expect("ranges that fit");
        check(&scene);
    }
}

/// Stiff motions leave the lanes for steps of the implicit method.
#[test]
fn lanes_do_not_change_stiff_motions() {
    let mut scene = Scene::from_toml(PRESETS[1]).expect("the preset");
    scene.accuracy = serde_json::from_str(r#""balanced""#).expect("an accuracy");
    // The short actions have two or three steps.
    for (damping, period) in [(1e3, 0.01), (400.0, 1e-4)] {
        scene.body.hand.damping = damping;
        scene.control.action_period = period;
        let task = task(&scene, 60);
        let alone = run(&task, 21, 1, Width::One);
        for lanes in Width::all() {
            assert!(run(&task, 21, 2, lanes) == alone, "{lanes:?} lanes");
        }
        let mut episode = Episode::new(&task).expect("an episode");
        for (_, snapshot) in &alone {
            episode.restore(snapshot).expect("its own kind");
            assert!(episode.sim.stats.factorisations > 0);
        }
    }
}

#[test]
fn a_batch_equals_its_single_episodes() {
    for accuracy in [
        r#"{"method": "moreau", "step": 0.001}"#,
        r#""balanced""#,
        LOCATED,
    ] {
        let mut scene = Scene::from_toml(PRESETS[1]).expect("the preset");
        scene.accuracy = serde_json::from_str(accuracy).expect("an accuracy");
        let task = task(&scene, 1000);
        let mut batch = Batch::new(task, 9, Autoreset::Disabled, Some(1)).expect("a batch");
        let task = batch.task.clone();
        // Other parameters than the scene's, including the time step.
        let start = |i: usize| Start {
            seed: Some(i as u64),
            params: match (i % 3, accuracy.contains("step")) {
                (0, _) => Default::default(),
                (k, true) => [("accuracy.step".into(), [0.0, 0.002, 0.005][k])].into(),
                (k, false) if accuracy == LOCATED => {
                    [("accuracy.tolerance".into(), [0.0, 1e-6, 1e-3][k])].into()
                }
                (k, false) => [("ice.gravity".into(), 9.0 + k as f64)].into(),
            },
            ..Start::default()
        };
        let starts: Vec<_> = (0..9).map(|i| (i, start(i))).collect();
        batch.reset(&starts, &|| true).expect("starts");
        let mut alone = batch.episodes.clone();
        let actions = vec![0.3; 9 * task.joints()];
        let mut observations = vec![0.0; 9 * task.observation.len()];
        let mut outcomes: Vec<Outcome> = alone.iter().map(|e| (e.result(), None)).collect();
        for _ in 0..20 {
            batch
                .step(&actions, &mut observations, &mut outcomes, &|| true)
                .expect("steps");
            for episode in &mut alone {
                episode.step(&task, &actions[..task.joints()]);
            }
        }
        for (i, (one, other)) in alone.iter().zip(&batch.episodes).enumerate() {
            assert_eq!(one.sim.stats.steps, other.sim.stats.steps, "episode {i}");
            assert!(
                one.snapshot() == other.snapshot(),
                "{accuracy}: episode {i}"
            );
        }
    }
}
