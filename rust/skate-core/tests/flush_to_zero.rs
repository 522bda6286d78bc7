//! Subnormal numbers count as zero: contact modes, events and motion do not depend on the processor's
//! flush-to-zero mode, which some libraries enable.
#![cfg(any(target_arch = "x86_64", target_arch = "aarch64"))]

mod presets;

use presets::PRESETS;
use rand::{Rng, SeedableRng};
use rand_chacha::ChaCha8Rng;
use skate_core::{
    error::Termination,
    model::{
        Model,
        layout::{NV, ROOT},
        state::State,
    },
    scene::Scene,
    sim::{Event, Simulation},
};
use std::{arch::asm, hint::black_box, thread};

const ACCURACIES: [&str; 5] = [
    r#""balanced""#,
    r#""reference""#,
    r#""fast""#,
    r#"{"method": "rosenbrock", "tolerance": 1e-4}"#,
    r#"{"method": "rk4", "step": 1e-3}"#,
];

/// Flush-to-zero (bit 15 of MXCSR) and denormals-are-zero (bit 6).
#[cfg(target_arch = "x86_64")]
fn flush_to_zero() {
    let mut control = 0_u32;
    // SAFETY: this changes the rounding of subnormals on the current thread only, which ends soon.
    unsafe {
        asm!("stmxcsr [{}]", in(reg) &raw mut control);
        control |= 1 << 15 | 1 << 6;
        asm!("ldmxcsr [{}]", in(reg) &raw const control);
    }
}

/// Flush-to-zero: bit 24 of FPCR.
#[cfg(target_arch = "aarch64")]
fn flush_to_zero() {
    // SAFETY: as on x86_64.
    unsafe {
        let mut control: u64;
        asm!("mrs {}, fpcr", out(reg) control);
        control |= 1 << 24;
        asm!("msr fpcr, {}", in(reg) control);
    }
}

/// Run on a new thread in flush-to-zero mode.
fn in_flush_to_zero_mode<T: Send>(what: impl FnOnce() -> T + Send) -> T {
    thread::scope(|scope| {
        let thread = scope.spawn(|| {
            flush_to_zero();
            what()
        });
        thread.join().expect("no panic")
    })
}

#[test]
fn flush_to_zero_mode_is_active() {
    let half = || black_box(f64::MIN_POSITIVE) * black_box(0.5);
    let same = || black_box(5e-324) * black_box(1e300);
    assert!(half() > 0.0 && same() > 0.0);
    assert_eq!(
        (in_flush_to_zero_mode(half), in_flush_to_zero_mode(same)),
        (0.0, 0.0)
    );
}

/// Events of one second and the final state.
fn run(scene: &Scene, seed: u64, tiny: Option<f64>) -> (Vec<Event>, State, Option<Termination>) {
    let model = Model::compile(scene).expect("a model");
    let mut sim = Simulation::new(model).expect("a start");
    let n = sim.model.n;
    let mut rng = ChaCha8Rng::seed_from_u64(seed);
    if let Some(tiny) = tiny {
        let (mut q, mut v) = (sim.state.q, sim.state.v);
        // Excluding the height and rotation of the pivot, which determine the contact mode.
        for c in ROOT..n {
            let sign = *[-1.0, 0.0, 1.0]
                .get(rng.random_range(0..3))
                .expect("one of three");
            q[c] += sign * tiny;
            v[c] = if v[c] == 0.0 || rng.random_bool(0.5) {
                sign * tiny
            } else {
                v[c]
            };
        }
        v[0] = tiny;
        let leg = sim.state.support_leg;
        sim.reset(&q, &v, leg).expect("a start");
    }
    let size = [0.0, tiny.unwrap_or(0.0), 1.0, 30.0];
    let mut events = Vec::new();
    while sim.ended.is_none() && sim.state.t < 1.0 {
        let size = size[rng.random_range(0..size.len())];
        let torque: [f64; NV] = std::array::from_fn(|_| size * rng.random_range(-1.0..1.0));
        sim.hold(&torque[..n - ROOT]);
        let until = sim.next_action_time();
        sim.advance(until);
        events.extend(sim.take_events());
    }
    (events, sim.state, sim.ended)
}

/// Measured: all 75 runs with 3,453 events agree bit for bit.
#[test]
fn motion_does_not_depend_on_flush_to_zero_mode() {
    let mut n_events = 0;
    for preset in PRESETS {
        let mut scene = Scene::from_toml(preset).expect("the preset");
        for accuracy in ACCURACIES {
            scene.accuracy = serde_json::from_str(accuracy).expect("an accuracy");
            for (seed, tiny) in [(1, None), (2, Some(5e-324)), (3, Some(1e-310))] {
                let default_mode = run(&scene, seed, tiny);
                let flushed = in_flush_to_zero_mode(|| run(&scene, seed, tiny));
                let what = format!("{} {accuracy} {tiny:?}", scene.name);
                assert!(
                    default_mode == flushed,
                    "{what}: {default_mode:?} {flushed:?}"
                );
                n_events += default_mode.0.len();
            }
        }
    }
    println!("{n_events} events");
    assert!(n_events > 1_000);
}
