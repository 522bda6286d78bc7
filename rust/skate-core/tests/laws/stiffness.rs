//! Motions that are stiff for explicit methods.

use rand::{Rng, SeedableRng};
use rand_chacha::ChaCha8Rng;
use skate_core::{
    model::{Model, layout::NV},
    scene::{ProportionalDerivative, Scene},
    sim::Simulation,
};

/// A preset, or a scene of the studies.
fn preset(name: &str) -> Scene {
    let folder = match name {
        "blade" | "paper_damped" => "studies/scenes",
        _ => "scenes",
    };
    let path = format!(
        "{}/../../skate_env/{folder}/{name}.toml",
        env!("CARGO_MANIFEST_DIR")
    );
    let text = std::fs::read_to_string(path).expect("a preset");
    Scene::from_toml(&text).expect("a scene")
}

fn start(scene: &Scene, accuracy: &str) -> Simulation {
    let accuracy = serde_json::from_str(accuracy).expect("an accuracy");
    let scene = Scene {
        accuracy,
        ..scene.clone()
    };
    Simulation::new(Model::compile(&scene).expect("a model")).expect("a start")
}

fn rosenbrock(tolerance: f64) -> String {
    format!(r#"{{"method": "rosenbrock", "tolerance": {tolerance}}}"#)
}

fn distance(a: &Simulation, b: &Simulation) -> f64 {
    let pairs = a.state.q.iter().zip(&b.state.q);
    pairs.fold(0.0, |most, (a, b)| most.max((a - b).abs()))
}

/// Motions that are not stiff are those of the explicit method, bit for bit. Of the scenes only `blade` is stiff, with
/// rates beyond 16,000 1/s.
#[test]
fn gaits_are_not_stiff() {
    for name in [
        "paper",
        "paper_arms",
        "paper_damped",
        "paper_printed",
        "push_only",
    ] {
        let scene = preset(name);
        let mut balanced = start(&scene, r#""balanced""#);
        let mut explicit = start(&scene, r#"{"method": "dop853", "tolerance": 1e-3}"#);
        balanced.advance(1.5);
        explicit.advance(1.5);
        assert_eq!(balanced.state, explicit.state, "{name}");
        assert_eq!(balanced.stats.factorisations, 0, "{name}");
    }
}

/// Joints with a damping of 1e3 N m s/rad, which have rates of 1e5 to 1e6 1/s, do not end a motion at `balanced`, and its
/// error remains small.
#[test]
fn stiff_motions_continue_with_the_implicit_method() {
    let mut scene = preset("paper_damped");
    scene.body.hand.damping = 1e3;
    let mut explicit = start(&scene, r#"{"method": "dop853", "tolerance": 5e-6}"#);
    explicit.advance(0.1);
    assert_eq!(explicit.ended.map(|cause| cause.name()), Some("step_limit"));
    let mut exact = start(&scene, &rosenbrock(1e-9));
    let mut balanced = start(&scene, r#""balanced""#);
    for sim in [&mut exact, &mut balanced] {
        sim.advance(0.1);
        assert_eq!(sim.ended, None);
    }
    // Measured 1.6e-4 rad, 648 evaluations and 78 factorisations.
    let apart = distance(&balanced, &exact);
    assert!(apart < 5e-4, "{apart}");
    let stats = balanced.stats;
    assert!(
        stats.evaluations < 2000 && stats.factorisations > 20,
        "{stats:?}"
    );
}

/// The explicit method is back after the contact mode has changed.
#[test]
fn the_explicit_method_returns_with_another_contact_mode() {
    let mut scene = preset("paper_damped");
    scene.stabilizers.free_knee_pd = Some(ProportionalDerivative::new(1e5, 1e5));
    let mut sim = start(&scene, r#""balanced""#);
    let (mut stiff, mut returns) = (false, 0);
    for i in 1..=1000 {
        let mode = sim.state.mode;
        sim.advance(1e-3 * f64::from(i));
        assert_eq!(sim.ended, None);
        if stiff && !sim.state.is_stiff {
            assert_ne!(mode, sim.state.mode);
            returns += 1;
        }
        stiff = sim.state.is_stiff;
    }
    // Measured: 2.
    assert!(returns > 0);
}

/// The linearly implicit method takes long steps where stabilizers of legs are stiff, and has the explicit method's limit.
#[test]
fn stiff_stabilizers_of_legs_do_not_shorten_implicit_steps() {
    let paper = preset("paper");
    let end = |on_hip: bool, damping: f64, accuracy: &str| {
        let mut scene = paper.clone();
        let torque = Some(ProportionalDerivative::new(0.3 * damping, damping));
        if on_hip {
            scene.stabilizers.hip_pd = torque;
        } else {
            scene.stabilizers.free_knee_pd = torque;
        }
        let mut sim = start(&scene, accuracy);
        sim.advance(0.1);
        (sim.ended, sim.state.q, sim.stats.evaluations)
    };
    for on_hip in [false, true] {
        let exact = end(on_hip, 2e3, "1e-9");
        let [far, near] = [1e-6, 1e-7].map(|tolerance| {
            let (ended, q, evaluations) = end(on_hip, 2e3, &rosenbrock(tolerance));
            assert_eq!(ended, None);
            let distances = (0..NV).map(|c| (q[c] - exact.1[c]).abs());
            (distances.fold(0.0, f64::max), evaluations)
        });
        // Measured 1.6e-6 and 1.9e-7 rad with the knee, 8.0e-6 and 1.6e-6 rad with the hip.
        assert!(far.0 < 5e-5 && near.0 < far.0 / 4.0, "{far:?} {near:?}");
        // Measured 2,953 of 6,850 and 2,809 of 10,392.
        assert!(near.1 < exact.2 / 2, "{} {}", near.1, exact.2);
        // Takes 898 and 1,024 evaluations; `balanced` ends with `step_limit`.
        let stiff = end(on_hip, 5e5, &rosenbrock(1e-5));
        assert_eq!(stiff.0, None);
    }
}

/// Steps of the implicit method have no derivatives.
#[test]
fn derivatives_of_stiff_motions_are_refused() {
    let mut scene = preset("paper_damped");
    scene.body.hand.damping = 1e3;
    let mut sim = start(&scene, r#""balanced""#);
    let torques = vec![0.0; sim.model.n - 3];
    let refused = sim.linearize(&torques, 0.02, &[], &|| true).err();
    let message = refused.expect("an error").0;
    assert!(
        message.starts_with("the motion is stiff at 0.00"),
        "{message}"
    );
}

/// A new torque excites fast motions, which the last step before it says nothing about. The first step after it is short
/// enough; with the length of the last one, 0.7 to 0.9 steps of an action are rejected.
#[test]
fn few_steps_after_new_torques_are_rejected() {
    for accuracy in [r#""balanced""#, "1e-8", r#""reference""#] {
        for name in ["paper", "paper_damped", "push_only"] {
            let mut rng = ChaCha8Rng::seed_from_u64(5);
            let mut sim = start(&preset(name), accuracy);
            let snapshot = sim.snapshot();
            let (mut actions, mut rejections) = (0, 0);
            for _ in 0..10 {
                sim.restore(&snapshot).expect("the start");
                for i in 1..=20 {
                    if sim.ended.is_some() {
                        break;
                    }
                    let torque: Vec<f64> = (3..sim.model.n)
                        .map(|_| rng.random_range(-20.0..20.0))
                        .collect();
                    sim.hold(&torque);
                    sim.advance(0.01 * f64::from(i));
                    actions += 1;
                }
                rejections += sim.stats.rejections;
            }
            let share = rejections as f64 / f64::from(actions);
            // Measured 0.195 and less.
            assert!(share < 0.3, "{accuracy} {name}: {share}");
        }
    }
}
