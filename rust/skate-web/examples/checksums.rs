//! Replays of scenes in the native engine, as JSON: `cargo run --release --example checksums -- STEPS SCENE.toml...`.
//!
//! Each scene runs with every named accuracy until it has made that many gait steps or has ended. The checksum is
//! that of q and v after every action. `web/test/replay.ts` does the same with the WebAssembly module.

use serde_json::{Map, Value, json};
use skate_core::numeric::checksum::checksum;
use skate_web::{engine::Engine, scene_edit::SceneEdit};
use std::time::Instant;

/// Entries of `Engine::state`.
const TIME: usize = 0;
const COORDINATES: usize = 1;
const TERMINATION: usize = 4;
const EVALUATIONS: usize = 16;
const GAIT_STEPS: usize = 17;
const POSITIONS: usize = 40;
const RATES: usize = 60;

/// Time in which a run is repeated for its time [s]; the least time counts.
const REPEATED: f64 = 0.5;

fn main() {
    let mut arguments = std::env::args().skip(1);
    let steps = arguments.next().and_then(|steps| steps.parse().ok());
    let steps: f64 = steps.expect("usage: checksums STEPS SCENE.toml...");
    let mut replays = Map::new();
    for file in arguments {
        let toml = std::fs::read_to_string(&file).expect("a readable scene file");
        let name = file
            .rsplit('/')
            .next()
            .unwrap_or(&file)
            .trim_end_matches(".toml");
        for accuracy in ["fast", "balanced", "reference"] {
            replays.insert(format!("{name} {accuracy}"), replay(&toml, accuracy, steps));
        }
    }
    println!("{}", Value::Object(replays));
}

fn engine(toml: &str, accuracy: &str) -> Engine {
    let edit = json!({"toml": toml, "accuracy": accuracy}).to_string();
    let edit = SceneEdit::from_json(edit.as_bytes()).expect("an edit");
    Engine::new(&edit).expect("a valid scene").0
}

fn replay(toml: &str, accuracy: &str, steps: f64) -> Value {
    let mut sim = engine(toml, accuracy);
    let (mut bytes, mut actions) = (Vec::new(), 0);
    let state = loop {
        let state = sim.state();
        let n = state[COORDINATES] as usize;
        for x in state[POSITIONS..][..n].iter().chain(&state[RATES..][..n]) {
            bytes.extend(x.to_le_bytes());
        }
        if state[GAIT_STEPS] >= steps || state[TERMINATION] != 0.0 || sim.step(1) == 0 {
            break state;
        }
        actions += 1;
    };
    let begun = Instant::now();
    let mut seconds = f64::INFINITY;
    loop {
        let mut sim = engine(toml, accuracy);
        let started = Instant::now();
        sim.step(actions);
        seconds = started.elapsed().as_secs_f64().min(seconds);
        if begun.elapsed().as_secs_f64() > REPEATED {
            break;
        }
    }
    json!({
        "actions": actions,
        "time": state[TIME],
        "steps": state[GAIT_STEPS],
        "termination": state[TERMINATION],
        "evaluations": state[EVALUATIONS],
        "checksum": format!("{:016x}", checksum(&bytes)),
        "seconds": seconds,
    })
}
