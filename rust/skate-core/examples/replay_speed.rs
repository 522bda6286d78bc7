//! Wall time and evaluations of a replay: `cargo run --release -p skate-core --example replay_speed -- FILE`.

use skate_core::{model::Model, scene::Scene, sim::Simulation};
use std::time::Instant;

fn main() {
    let file = std::env::args().nth(1).expect("usage: replay_speed SCENE");
    let text = std::fs::read_to_string(&file).expect("a readable scene file");
    let scene = if file.ends_with(".json") {
        Scene::from_json(&text)
    } else {
        Scene::from_toml(&text)
    };
    let model = Model::compile(&scene.expect("a valid scene")).expect("a model");
    let mut sim = Simulation::new(model).expect("a start");
    let begun = Instant::now();
    let mut steps = 0;
    let period = sim.model.scene.control.action_period;
    while steps < 100 && sim.ended.is_none() {
        let until = sim.state.t + period;
        sim.advance(until);
        for e in sim.take_events() {
            if steps < 3 {
                println!(
                    "{:.4} {:>3} -> {:>3}  {} {} | {}",
                    e.t,
                    e.from.number(),
                    e.to.number(),
                    e.what,
                    e.leg.name(),
                    e.to.name()
                );
            }
        }
        for r in sim.take_records() {
            steps += 1;
            if steps <= 5 {
                println!("{steps} {r:?}");
            }
        }
    }
    let wall = begun.elapsed().as_secs_f64();
    let t = sim.state.t;
    println!(
        "{steps} steps, {t:.3} s, ended {:?}, wall {wall:.4} s, {:.0} x real time, {:?}",
        sim.ended,
        t / wall,
        sim.stats
    );
    println!(
        "{:.2} us per evaluation",
        wall * 1e6 / sim.stats.evaluations as f64
    );
    let eval = sim.survey();
    let (k, p) = eval.inertias.energy(&sim.model, &eval.kin, sim.state.q[1]);
    println!("energy {k:.3} {p:.3} {:?}", sim.state.ledger);
}
