//! Regression tests of calls in unusual order or with unusual numbers.

use skate_core::{
    error::Termination,
    model::Model,
    numeric::stack::with_stack,
    scene::Scene,
    sim::{Coordinates, Simulation},
};
use std::thread;

const PAPER: &str = include_str!("../../../skate_env/scenes/paper_printed.toml");

fn paper() -> Simulation {
    let scene = Scene::from_toml(PAPER).expect("the preset");
    Simulation::new(Model::compile(&scene).expect("a model")).expect("a start")
}

/// Sample times inside a step used to be counted as fractions of the step, which did not terminate for tiny
/// steps.
#[test]
fn the_shortest_advance_terminates() {
    for least in [f64::from_bits(1), 1e-310, f64::MIN_POSITIVE, 1e-300] {
        let mut sim = paper();
        sim.advance(least);
        assert_eq!((sim.state.t, sim.ended), (least, None));
    }
}

/// Counters used to be outdated after a hold, a reset or a reset map until the next advance.
#[test]
fn counters_are_up_to_date_after_every_call() {
    let mut sim = paper();
    sim.advance(0.01);
    let torque = vec![1.0; sim.model.n - 3];
    sim.hold(&torque);
    assert_eq!(sim.stats.evaluations, sim.eval.count);
    let (t, Coordinates { q, v }) = (sim.state.t, sim.coordinates());
    sim.reset_map(t, &q, &v, None).expect("a sample");
    assert_eq!(sim.stats.evaluations, sim.eval.count);
    // A terminated simulation does not change, nor does its snapshot.
    sim.hold(&vec![f64::NAN; torque.len()]);
    assert!(sim.ended.is_some());
    let before = sim.snapshot();
    sim.advance(1.0);
    assert!(sim.snapshot() == before);
}

/// A motion may exceed the range of a start; its snapshot used to be refused with the range of a start.
#[test]
fn a_snapshot_of_a_fast_motion_is_restored() {
    let mut sim = paper();
    sim.state.v[0] = 2e6;
    // At 1e9 m/s and for 1e9 s, the most that there are, a robot comes to 1e18 m.
    sim.state.q[0] = 1e30;
    let saved = sim.snapshot();
    sim.restore(&saved).expect("its own");
    assert!(sim.snapshot() == saved);
}

/// Damage to any byte of a snapshot is detected, and the simulation does not change.
#[test]
fn damage_to_any_snapshot_byte_is_detected() {
    let mut sim = paper();
    sim.advance(0.1);
    let saved = sim.snapshot();
    for at in 0..saved.len() {
        let mut damaged = saved.clone();
        damaged[at] ^= 1 << (at % 8);
        assert!(sim.restore(&damaged).is_err(), "byte {at}");
        assert!(sim.restore(&saved[..at]).is_err(), "cut at {at}");
    }
    assert!(sim.snapshot() == saved);
}

/// `fast` used to let an end that landed slower than 1 mm/s stick, even on ice without friction.
#[test]
fn a_slow_landing_without_friction_keeps_sliding() {
    let scene = Scene::from_json(
        r#"{"accuracy": "fast", "contact": {"law": "push_only"},
            "ice": {"gravity": 0, "friction": {"kind": "none"}},
            "start": {"q": {"z0": 1.28e-6, "q1": -0.1, "q5": 0.5, "q6": -0.9, "q7": 0.4},
                      "v": {"z0": -9.5e-4, "y0": 1}}}"#,
    );
    let model = Model::compile(&scene.expect("a scene")).expect("a model");
    let mut sim = Simulation::new(model).expect("a start");
    let along = |sim: &Simulation| {
        let eval = sim.full_kinematics();
        eval.inertias.momentum(&sim.model, &eval.kin).0[0]
    };
    let start = along(&sim);
    sim.advance(0.02);
    let landings = sim.take_events();
    assert!(landings.iter().any(|event| event.what.contains("lands")));
    println!("{:e}", along(&sim) / start - 1.0);
    // Measured 2e-15.
    let change = (along(&sim) / start - 1.0).abs();
    assert!(change < 1e-9, "{change:e}");
}

/// A foot with an initial speed of 5e-324 m/s used to slide, except in flush-to-zero mode.
#[test]
fn a_subnormal_speed_is_zero() {
    let mut sim = paper();
    let (mut q, mut v) = (sim.state.q, sim.state.v);
    (q[2], v[0]) = (1e-310, f64::from_bits(1));
    sim.reset(&q, &v, sim.state.support_leg).expect("a start");
    assert_eq!((sim.state.q[2], sim.state.v[0]), (0.0, 0.0));
}

/// With too coarse a method the robot used to reach 1e246 rad/s, and its energy balance NaN.
#[test]
fn an_unbounded_motion_terminates_with_a_cause() {
    for accuracy in [r#""fast""#, r#"{"method": "rk4", "step": 1e-3}"#] {
        let mut scene = Scene::from_toml(PAPER).expect("the preset");
        scene.accuracy = serde_json::from_str(accuracy).expect("an accuracy");
        let mut sim = Simulation::new(Model::compile(&scene).expect("a model")).expect("a start");
        sim.state.v[8] = 2e9;
        sim.advance(0.01);
        assert_eq!(sim.ended, Some(Termination::NotFinite), "{accuracy}");
        assert!(sim.state.energy_balance.total().is_finite());
    }
}

/// Time steps depend on forces and torque jumps of earlier steps, which a snapshot contains.
#[test]
fn time_stepping_continues_from_a_snapshot() {
    let mut scene = Scene::from_toml(PAPER).expect("the preset");
    scene.accuracy = serde_json::from_str(r#""fast""#).expect("an accuracy");
    let model = Model::compile(&scene).expect("a model");
    let mut whole = Simulation::new(model.clone()).expect("a start");
    let mut torque = vec![0.0; whole.model.n - 3];
    for action in 0..500 {
        // Only at some actions: in between, the release time of feet depends on the forces of the previous
        // step.
        if action % 50 == 0 {
            torque[4] = 2.0 - torque[4];
        }
        whole.hold(&torque);
        for part in [0.4, 0.6] {
            let mut twin = Simulation::new(model.clone()).expect("a start");
            twin.restore(&whole.snapshot()).expect("its own");
            let until = whole.state.t + 0.01 * part;
            whole.advance(until);
            twin.advance(until);
            assert!(twin.snapshot() == whole.snapshot(), "{until}");
        }
    }
    assert_eq!(whole.ended, None);
}

/// Times since the last step used to be negative after a reset map to an earlier time.
#[test]
fn a_reset_map_to_an_earlier_time_begins_a_gait_step() {
    let mut sim = paper();
    sim.advance(1.5);
    assert!(!sim.take_records().is_empty());
    let (t, Coordinates { q, v }) = (0.1, sim.coordinates());
    sim.reset_map(t, &q, &v, None).expect("a sample");
    assert!(sim.since_event() >= 0.0 && sim.since_step() >= 0.0);
    sim.advance(2.0);
    let records = sim.take_records();
    let first = records.first().expect("a gait step");
    assert!((first.period - (first.time - t)).abs() < 1e-12);
}

/// Derivatives used to overflow it.
#[test]
fn a_call_on_a_small_stack_gets_a_larger_one() {
    let call = || {
        let mut sim = Box::new(paper());
        let torques = vec![0.0; sim.model.n - 3];
        sim.linearize(&torques, 0.4, &[], &|| true).is_ok()
    };
    let small = thread::Builder::new().stack_size(1 << 16);
    let thread = small.spawn(move || with_stack(call)).expect("a thread");
    assert!(thread.join().expect("an end"));
}
