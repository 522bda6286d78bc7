//! Speed of a replay relative to real time, at each named accuracy: `cargo run --release -p skate-core --example
//! replay_speed -- SCENE.toml`.
//!
//! Prints the minimum wall time of several runs in one process on one core; the counters are deterministic.

use skate_core::{
    model::Model,
    scene::{Accuracy, AccuracyName, Scene},
    sim::Simulation,
};
use std::time::Instant;

const RUNS: usize = 10;
const STEPS: usize = 100;

fn main() {
    let file = std::env::args().nth(1).expect("usage: replay_speed SCENE");
    let text = std::fs::read_to_string(&file).expect("a readable scene file");
    let mut scene = Scene::from_toml(&text).expect("a valid scene");
    for name in [
        AccuracyName::Balanced,
        AccuracyName::Fast,
        AccuracyName::Reference,
    ] {
        scene.accuracy = Accuracy::Named(name);
        let model = Model::compile(&scene).expect("a model");
        let start = Simulation::new(model).expect("a start");
        println!("{name:?}");
        measure(&start);
    }
}

fn measure(start: &Simulation) {
    let mut best = f64::INFINITY;
    let mut sim = start.clone();
    let mut steps = 0;
    for _ in 0..RUNS {
        sim = start.clone();
        let started = Instant::now();
        steps = replay(&mut sim);
        best = best.min(started.elapsed().as_secs_f64());
    }
    let (t, stats) = (sim.state.t, &sim.stats);
    let end = sim.ended.map_or("no end", |cause| cause.name());
    println!("{steps} steps in {t:.3} s of motion, {end}; {stats:?}");
    println!(
        "least of {RUNS} runs: {best:.4} s, {:.0} times real time, {:.2} us per evaluation",
        t / best,
        best * 1e6 / stats.evaluations as f64
    );
}

/// Advance by action periods, as the environment does, until enough gait steps are completed.
fn replay(sim: &mut Simulation) -> usize {
    let mut steps = 0;
    while steps < STEPS && sim.ended.is_none() {
        let until = sim.next_action_time();
        sim.advance(until);
        sim.take_events();
        steps += sim.take_records().len();
    }
    steps
}
