//! Fuzzing of the engine: arbitrary bytes are decoded into a scene and a sequence of API calls, and properties
//! that must always hold are checked.
//!
//! `make fuzz SECONDS=600` searches for inputs that violate a property. It runs
//!
//! ```text
//! cargo +nightly fuzz run --fuzz-dir rust/skate-fuzz --features libfuzzer --sanitizer none \
//!     scene_and_steps target/fuzz rust/skate-fuzz/corpus/scene_and_steps -- \
//!     -timeout=20 -max_len=1024 -max_total_time=600
//! ```
//!
//! and needs a nightly Rust, a C++ compiler and `cargo install cargo-fuzz`. No sanitizer is used; overflows
//! and debug assertions panic. The fuzzer writes findings to `artifacts/`. After the fix, a finding moves to
//! `finds/` under a descriptive name. `cargo test` replays the corpus and all findings without the fuzzer, on
//! any Rust.

mod draw;
mod laws;
mod operations;
mod scenes;

use arbitrary::Unstructured;
use skate_core::{model::Model, sim::Simulation};

/// Maximum number of calls per input.
const MAX_CALLS: usize = 24;

/// Run an input. Returns the final snapshot, or None if the bytes give no simulation.
///
/// # Panics
/// If a property of `laws` is violated.
pub fn run_input(bytes: &[u8]) -> Option<Vec<u8>> {
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
    laws::assert_finite(&sim);
    // Breaches are no findings: calls set states and apply guards that no motion has. The checker must not panic.
    sim.check(true);
    let mut budget = operations::Budget::default();
    for _ in 0..MAX_CALLS {
        if u.is_empty() || budget.is_spent() {
            break;
        }
        operations::random_call(&mut sim, &mut u, &mut budget);
        laws::assert_finite(&sim);
    }
    Some(sim.snapshot())
}
