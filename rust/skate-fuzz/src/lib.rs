//! Any bytes are a scene and what somebody does with it: what must hold whatever they are.
//!
//! `make fuzz SECONDS=600` looks for bytes that break a law. It comes down to
//!
//! ```text
//! cargo +nightly fuzz run --fuzz-dir rust/skate-fuzz --features libfuzzer --sanitizer none \
//!     scene_and_steps target/fuzz rust/skate-fuzz/corpus/scene_and_steps -- \
//!     -timeout=20 -max_len=1024 -max_total_time=600
//! ```
//!
//! and needs a nightly Rust, a C++ compiler and `cargo install cargo-fuzz`. Neither the engine nor this
//! crate has unsafe code, so no sanitizer watches; overflows and debug assertions panic. What it finds
//! stands in `artifacts/`; mended, it moves to `finds/` under a name for what it showed. `cargo test`
//! plays the corpus and all finds again, without the fuzzer, on any Rust.

mod draw;
mod laws;
mod operations;
mod scenes;

use arbitrary::Unstructured;
use skate_core::{model::Model, sim::Simulation};

/// Most operations of one play.
const OPERATIONS: usize = 24;

/// Play what the bytes say; returns how the simulation stands in the end, if there was one.
///
/// # Panics
/// Where a law of `laws` is broken.
pub fn play(bytes: &[u8]) -> Option<Vec<u8>> {
    let mut u = Unstructured::new(bytes);
    let scene = scenes::scene(&mut u)?;
    laws::scene_survives_text(&scene);
    let model = Model::compile(&scene).expect("a valid scene compiles");
    let mut sim = match Simulation::new(model) {
        Ok(sim) => sim,
        Err(refused) => {
            assert!(!refused.0.is_empty());
            return None;
        }
    };
    laws::sound(&sim);
    let mut budget = operations::Budget::default();
    for _ in 0..OPERATIONS {
        if u.is_empty() || budget.is_spent() {
            break;
        }
        operations::operate(&mut sim, &mut u, &mut budget);
        laws::sound(&sim);
    }
    Some(sim.snapshot())
}
