//! Laws of whole motions.

use super::bare;
use skate_core::{
    dynamics::bias_forces,
    model::{Model, layout::NV},
    scene::Scene,
    sim::Simulation,
};

const LOCKED: &str = r#""locked": ["q8","q9","q10","q11","q12","q13","q14","q15","q16","q17"]"#;

/// Without damping, flight conserves energy and momenta up to the effect of gravity.
#[test]
fn flight_conserves_energy_and_momenta() {
    let links = [
        "head",
        "upper_body",
        "middle_body",
        "lower_body",
        "upper_arm",
        "lower_arm",
        "hand",
        "upper_leg",
        "lower_leg",
        "foot",
    ];
    let free: Vec<String> = links
        .iter()
        .map(|l| format!(r#""{l}": {{"damping": 0}}"#))
        .collect();
    for gravity in [9.81, 0.0] {
        // Free out-of-plane joints of the trunk let the reaction of the sagittal constraint change the
        // momenta.
        let scene = format!(
            r#"{{"accuracy": 1e-11, "locked": ["q8", "q10"], "body": {{{}}},
                "ice": {{"gravity": {gravity}}},
                "contact": {{"law": "push_only"}}, "fall": {{"head_height": -10}},
                "start": {{"q": {{"z0": 30, "q2": 0.4, "q3": -0.3, "q5": -0.2, "q6": -0.3, "q11": 0.5}},
                "v": {{"z0": 11, "y0": 1, "q1": 0.5, "q2": -2, "q5": 3, "q6": 2, "q11": 4, "q17": 2}}}}}}"#,
            free.join(",")
        );
        let mut sim = Simulation::new(bare(&scene)).expect("a start");
        let measure = |sim: &Simulation| {
            let eval = sim.full_kinematics();
            let (k, p) = bias_forces::energy(&sim.model, &eval.kin, &sim.state.v, sim.state.q[1]);
            let ([py, pz], l) = eval.inertias.momentum(&sim.model, &eval.kin);
            [k + p, py, pz, l + sim.state.q[0] * pz - sim.state.q[1] * py]
        };
        let start = measure(&sim);
        sim.advance(2.0);
        assert_eq!(sim.ended, None);
        let mut end = measure(&sim);
        end[2] += sim.model.mass() * gravity * 2.0;
        // Gravity changes the angular momentum about the world's origin; without gravity it is conserved.
        let kept = if gravity > 0.0 { 3 } else { 4 };
        for i in 0..kept {
            // Measured at most 6e-13.
            assert!(
                (end[i] / start[i] - 1.0).abs() < 1e-9,
                "{i}: {start:?} {end:?}"
            );
        }
    }
}

/// A body whose joints are held rigid stops after v^2 / (2 mu g), at the time v / (mu g).
#[test]
fn sliding_to_rest_agrees_with_the_closed_form() {
    for (speed, mu) in [(1.0_f64, 0.2), (-1.0, 0.9)] {
        for capture in [0.0, 0.01] {
            let scene = format!(
                r#"{{{LOCKED}, "accuracy": "reference", "ice": {{"friction": {{"capture_speed": {capture}}}}},
                    "start": {{"q": {{"q5": 0.5, "q6": -0.8, "q7": 0.3}}, "v": {{"y0": {speed}}}}}}}"#
            );
            let mut sim = Simulation::new(bare(&scene)).expect("a start");
            // Inverse dynamics gives the torques that keep the body rigid while it decelerates.
            let n = sim.model.n;
            let deceleration = -speed.signum() * mu * 9.81;
            let mut qdd = [0.0; NV];
            qdd[0] = deceleration;
            let mut tau = [0.0; NV];
            let eval = sim.full_kinematics();
            eval.inertias
                .inverse_dynamics(&sim.model, &eval.kin, &qdd, &mut tau);
            sim.hold(&tau[3..n]);
            let inertia = sim.eval.factored.problem.S[(0, 0)];
            let until = (speed.abs() - capture) / (mu * 9.81);
            sim.advance(until - 1e-6);
            assert_eq!(sim.state.mode.number(), 3);
            let mut stop = None;
            let begin = sim.state.t;
            while stop.is_none() && sim.state.t < begin + 1e-4 {
                let next = sim.state.t + 1e-5;
                sim.advance(next);
                stop = sim
                    .take_events()
                    .iter()
                    .find(|e| e.to.number() == 1)
                    .map(|e| e.t);
            }
            let t = stop.expect("it stops");
            // Measured 7e-14 s, 8e-15 m.
            assert!((t - until).abs() < 1e-9, "{t} {until}");
            let way = (speed * speed - capture * capture) / (2.0 * mu * 9.81);
            assert!(
                (sim.state.q[0].abs() - way).abs() < 1e-9,
                "{} {way}",
                sim.state.q[0]
            );
            // The capture stops the foot only, while the other bodies move on; S is the effective inertia
            // at the foot.
            let taken = 0.5 * inertia * capture * capture;
            assert!(
                (sim.state.energy_balance.capture - taken).abs() < 1e-9,
                "{:?}",
                sim.state.energy_balance
            );
        }
    }
}

/// Kinetic and potential energy change by the entries of the energy balance, including impacts and
/// friction.
#[test]
fn the_energy_balance_closes() {
    let text = include_str!("../../../../skate_env/scenes/paper_printed.toml");
    let mut scene = Scene::from_toml(text).expect("the preset");
    scene.accuracy = skate_core::scene::Accuracy::Tolerance(1e-11);
    let mut sim = Simulation::new(Model::compile(&scene).expect("a model")).expect("a start");
    let energy = |sim: &Simulation| {
        let eval = sim.full_kinematics();
        let (k, p) = bias_forces::energy(&sim.model, &eval.kin, &sim.state.v, sim.state.q[1]);
        k + p
    };
    let start = energy(&sim);
    let mut largest: f64 = 0.0;
    while sim.state.t < 2.5 {
        let next = sim.state.t + 0.01;
        sim.advance(next);
        let l = sim.state.energy_balance;
        let balance = l.actuators - l.damping - l.friction - l.impacts - l.capture;
        largest = largest.max((energy(&sim) - start - balance).abs());
    }
    assert_eq!(sim.ended, None);
    // Measured 2.2e-9 J; the largest kinetic energy is about 1,000 J.
    assert!(largest < 1e-7, "{largest:e}");
}

/// A restored snapshot continues bit for bit, at every accuracy.
#[test]
fn a_snapshot_continues_bit_for_bit() {
    let text = include_str!("../../../../skate_env/scenes/paper_printed.toml");
    let paper = Scene::from_toml(text).expect("the preset");
    for accuracy in [
        r#""balanced""#,
        r#""fast""#,
        r#"{"method": "rosenbrock", "tolerance": 1e-4}"#,
        r#"{"method": "rk4", "step": 1e-3}"#,
    ] {
        let mut scene = paper.clone();
        scene.accuracy = serde_json::from_str(accuracy).expect("an accuracy");
        let model = Model::compile(&scene).expect("a model");
        let mut sim = Simulation::new(model).expect("a start");
        sim.advance(0.5);
        let saved = sim.snapshot();
        let mut other = Simulation::new(sim.model.clone()).expect("a start");
        other.restore(&saved).expect("a snapshot");
        for sim in [&mut sim, &mut other] {
            sim.advance(2.0);
        }
        assert_eq!(sim.state, other.state, "{accuracy}");
        assert_eq!(sim.stats, other.stats, "{accuracy}");
        for cut in [0, 5, saved.len() / 2, saved.len() - 1] {
            assert!(other.restore(&saved[..cut]).is_err());
        }
        assert_eq!(sim.state, other.state);
    }
}

/// A motion that is interrupted after every time step differs by rounding only.
#[test]
fn time_steps_add_up_to_an_action_period() {
    let text = include_str!("../../../../skate_env/scenes/paper_printed.toml");
    let mut scene = Scene::from_toml(text).expect("the preset");
    scene.accuracy = serde_json::from_str(r#""fast""#).expect("an accuracy");
    let mut whole = Simulation::new(Model::compile(&scene).expect("a model")).expect("a start");
    // No event occurs between 0.05 s and 0.12 s, so no step is divided.
    whole.advance(0.05);
    let mut parts = whole.clone();
    while parts.state.t < 0.12 - 1e-9 {
        let mut steps = 0..1;
        parts.advance_while(parts.next_action_time(), || steps.next().is_some());
        assert_eq!(parts.ended, None);
    }
    while whole.state.t < parts.state.t - 1e-9 {
        let until = whole.next_action_time();
        whole.advance(until);
    }
    assert!((whole.state.t - parts.state.t).abs() < 1e-12);
    let pairs = whole.state.q.iter().zip(&parts.state.q);
    let worst = pairs.map(|(a, b)| (a - b).abs()).fold(0.0, f64::max);
    // 1.1e-15 measured.
    assert!(worst < 1e-12, "{worst:e}");
}
