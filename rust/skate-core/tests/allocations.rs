//! Time steps do not allocate heap memory.

mod presets;

use presets::PRESETS;
use rand::{Rng, SeedableRng, seq::IndexedRandom};
use rand_chacha::ChaCha8Rng;
use skate_core::{
    batch::{Autoreset, Batch},
    model::{
        Model,
        layout::{NV, ROOT},
    },
    scene::Scene,
    sim::{LOG_CAPACITY, Simulation},
    task::{EpisodeStatus, Start, Task, Weights},
};
use std::{
    alloc::{GlobalAlloc, Layout, System},
    cell::Cell,
};

/// Allocator that counts allocations per thread.
struct Counting;

thread_local! {
    static COUNT: Cell<u64> = const { Cell::new(0) };
}

// SAFETY: all calls are forwarded to the system allocator; the counter is a cell without a destructor.
unsafe impl GlobalAlloc for Counting {
    unsafe fn alloc(&self, layout: Layout) -> *mut u8 {
        COUNT.set(COUNT.get() + 1);
        unsafe { System.alloc(layout) }
    }

    unsafe fn realloc(&self, at: *mut u8, layout: Layout, size: usize) -> *mut u8 {
        COUNT.set(COUNT.get() + 1);
        unsafe { System.realloc(at, layout, size) }
    }

    unsafe fn dealloc(&self, at: *mut u8, layout: Layout) {
        unsafe { System.dealloc(at, layout) }
    }
}

#[global_allocator]
static COUNTING: Counting = Counting;

const ACCURACIES: [&str; 5] = [
    r#""balanced""#,
    r#""reference""#,
    r#""fast""#,
    r#"{"method": "rosenbrock", "tolerance": 1e-4}"#,
    r#"{"method": "rk4", "step": 5e-4}"#,
];

/// Simulated time per preset and accuracy [s].
const TIME: f64 = 1.0;

fn simulation(preset: &str, accuracy: &str) -> Simulation {
    let mut scene = Scene::from_toml(preset).expect("the preset");
    scene.accuracy = serde_json::from_str(accuracy).expect("an accuracy");
    Simulation::new(Model::compile(&scene).expect("a model")).expect("a start")
}

#[test]
fn the_allocator_counts() {
    let before = COUNT.get();
    drop(std::hint::black_box(vec![1.0; 10]));
    assert_eq!(COUNT.get() - before, 1);
}

/// Events and gait steps are not taken, as in the Gymnasium environment. The motions include landings, leg
/// swaps and terminations.
#[test]
fn steps_do_not_allocate() {
    let mut rng = ChaCha8Rng::seed_from_u64(11);
    let (mut events, mut falls, mut swaps, mut steps) = (0, 0, 0, 0);
    for preset in PRESETS {
        for accuracy in ACCURACIES {
            let mut sim = simulation(preset, accuracy);
            let n = sim.model.n;
            let start = (sim.state.q, sim.state.v, sim.state.support_leg);
            let mut time = 0.0;
            while time < TIME {
                let size = *[0.0, 3.0, 30.0, 300.0].choose(&mut rng).expect("some");
                let torque: [f64; NV] = std::array::from_fn(|_| size * rng.random_range(-1.0..1.0));
                let before = (COUNT.get(), sim.state.support_leg);
                if rng.random_bool(0.05) {
                    sim.kick(rng.random_range(-1.0..1.0)).expect("a kick");
                }
                sim.hold(&torque[..n - ROOT]);
                let until = sim.next_action_time();
                sim.advance(until);
                assert_eq!(COUNT.get() - before.0, 0, "{accuracy} at {} s", sim.state.t);
                time += sim.model.scene.control.action_period;
                swaps += u32::from(sim.state.support_leg != before.1);
                if sim.ended.is_some() {
                    falls += 1;
                    (events, steps) = (events + sim.stats.events, steps + sim.stats.steps);
                    sim.reset(&start.0, &start.1, start.2).expect("as before");
                }
            }
            (events, steps) = (events + sim.stats.events, steps + sim.stats.steps);
        }
    }
    println!("{steps} steps, {events} events, {swaps} swaps, {falls} ends");
    assert!(events > 1_000 && swaps > 20 && falls > 20);
}

/// Actions, observations and rewards of a batch do not allocate, nor do resets to the scene's start.
#[test]
fn batch_actions_do_not_allocate() {
    for (n, accuracy) in [(5, "\"balanced\""), (80, "\"fast\"")] {
        check_batch(n, accuracy);
    }
}

fn check_batch(n: usize, accuracy: &str) {
    let scene = simulation(PRESETS[1], accuracy).model.scene.clone();
    let mut task = Task::new(scene, vec![100.0; 16], Weights::default()).expect("a task");
    (task.trunk_noise, task.kick) = (0.02, 0.3);
    let mut batch = Batch::new(task, n, Autoreset::NextStep, Some(1)).expect("a batch");
    let starts: Vec<_> = (0..n).map(|i| (i, Start::default())).collect();
    batch.reset(&starts, &|| true).expect("the scene's start");
    let mut observations = vec![0.0; n * batch.task.observation.len()];
    let mut outcomes: Vec<_> = batch.episodes.iter().map(|e| (e.result(), None)).collect();
    let mut rng = ChaCha8Rng::seed_from_u64(3);
    let mut ended = 0;
    for _ in 0..400 {
        let actions: Vec<f64> = (0..n * 16).map(|_| rng.random_range(-1.0..1.0)).collect();
        let resets = batch
            .episodes
            .iter()
            .any(|e| e.status() == EpisodeStatus::Over);
        let before = COUNT.get();
        batch
            .step(&actions, &mut observations, &mut outcomes, &|| true)
            .expect("starts");
        assert_eq!(COUNT.get() - before, 0);
        ended += u32::from(resets);
    }
    println!("{n} at {accuracy}: {ended} of 400 steps with resets");
    assert!((5..200).contains(&ended));
}

/// The log is bounded: only the last events are kept.
#[test]
fn the_event_log_is_bounded() {
    let mut sim = simulation(PRESETS[5], ACCURACIES[0]);
    while sim.stats.events < 3 * LOG_CAPACITY as u64 {
        let before = COUNT.get();
        let until = sim.next_action_time();
        sim.advance(until);
        assert_eq!((COUNT.get() - before, sim.ended), (0, None));
    }
    let kept = sim.take_events();
    assert_eq!(kept.len(), LOG_CAPACITY);
    assert!(kept.windows(2).all(|pair| pair[0].t <= pair[1].t));
    assert!(kept[LOG_CAPACITY - 1].t <= sim.state.t && kept[0].t > 0.0);
    assert!(sim.take_events().is_empty());
}
