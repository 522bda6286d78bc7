//! Laws of time stepping at any step length.

use super::{bare, draw};
use rand::{Rng, SeedableRng};
use rand_chacha::ChaCha8Rng;
use skate_core::{
    model::{
        Model,
        contact_mode::SoleContact,
        layout::{LEG, NV, ROOT},
    },
    scene::Scene,
    sim::Simulation,
};

/// Motion of the robot as a whole, from the momenta of its bodies.
struct Whole {
    /// Position from O [m] and momentum [kg m/s] of the centre of mass.
    at: [f64; 2],
    momentum: [f64; 2],
    /// Angular momentum about the centre of mass [kg m2/s].
    spin: f64,
}

impl Whole {
    fn of(sim: &Simulation) -> Self {
        let (eval, model) = (sim.full_kinematics(), &sim.model);
        let (momentum, about_o) = eval.inertias.momentum(model, &eval.kin);
        let mut at = [0.0; 2];
        for (b, body) in model.bodies.iter().enumerate() {
            let c = eval.kin.point(model, b, &body.com);
            at[0] += body.mass / model.mass() * c.y;
            at[1] += body.mass / model.mass() * c.z;
        }
        Self {
            at,
            momentum,
            spin: about_o - (at[0] * momentum[1] - at[1] * momentum[0]),
        }
    }
}

/// A robot on push-only ice with these parts of a scene.
fn robot(parts: &str, step: f64) -> Simulation {
    let scene = format!(
        r#"{{"accuracy": {{"method": "moreau", "step": {step}}}, "contact": {{"law": "push_only"}}{parts}}}"#
    );
    Simulation::new(bare(&scene)).expect("a start")
}

/// Torques up to `size` on the joints of the legs, one hundredth of it on the lighter bodies above [N m].
fn torques(rng: &mut ChaCha8Rng, n: usize, size: f64) -> Vec<f64> {
    let mut torques = draw(rng, n, size);
    torques[LEG..].iter_mut().for_each(|torque| *torque *= 0.01);
    torques[ROOT..n].to_vec()
}

/// In flight only gravity changes the momentum, and nothing the angular momentum about the centre of mass, which moves
/// along a parabola.
#[test]
fn flight_conserves_momenta_at_any_step() {
    let mut rng = ChaCha8Rng::seed_from_u64(1);
    let mut worst = [0.0_f64; 3];
    for parts in [
        "",
        r#", "ice": {"gravity": 0}"#,
        r#", "locked": ["q8", "q11", "q16"]"#,
        r#", "locked": ["q8","q9","q10","q11","q12","q13","q14","q15","q16","q17"]"#,
    ] {
        for step in [1e-4, 1e-3, 5e-3, 2e-2, 0.1] {
            let mut sim = robot(parts, step);
            let (n, mass, gravity) = (sim.model.n, sim.model.mass(), sim.model.scene.ice.gravity);
            for _ in 0..10 {
                let (mut q, v) = (draw(&mut rng, n, 1.0), draw(&mut rng, n, 5.0));
                q[1] += 30.0;
                sim.reset(&q, &v, Default::default()).expect("a start");
                for _ in 0..20 {
                    sim.hold(&torques(&mut rng, n, 100.0));
                    let (start, t, at) = (Whole::of(&sim), sim.state.t, sim.state.q);
                    sim.advance(t + step);
                    assert_eq!(sim.ended, None);
                    assert_eq!(sim.state.mode.support.touch, SoleContact::Air);
                    let (end, h) = (Whole::of(&sim), sim.state.t - t);
                    let fall = h * mass * gravity;
                    let changes = [
                        end.momentum[0] - start.momentum[0],
                        end.momentum[1] - start.momentum[1] + fall,
                    ];
                    let moved = [h * start.momentum[0], h * (start.momentum[1] - 0.5 * fall)];
                    for i in 0..2 {
                        worst[0] = worst[0].max(changes[i].abs() / mass);
                        let moves = sim.state.q[i] - at[i] + end.at[i] - start.at[i];
                        worst[2] = worst[2].max((moves - moved[i] / mass).abs());
                    }
                    worst[1] = worst[1].max((end.spin - start.spin).abs() / mass);
                }
            }
        }
    }
    // Measured 2e-14 m/s, 2e-14 m2/s and 3e-14 m.
    assert!(worst.iter().all(|worst| *worst < 1e-9), "{worst:?}");
}

/// Where no foot sticks, the momentum along the ice changes by the friction alone; the forces of a step are means.
#[test]
fn sliding_feet_change_the_momentum_by_friction_alone() {
    let mut rng = ChaCha8Rng::seed_from_u64(2);
    let (mut worst, mut steps) = (0.0_f64, 0);
    for law in ["two_way", "push_only"] {
        for friction in [r#"{"kind": "none"}"#, r#"{"kind": "directional"}"#] {
            for step in [1e-3, 5e-3] {
                let scene = format!(
                    r#"{{"accuracy": {{"method": "moreau", "step": {step}}}, "contact": {{"law": "{law}"}},
                        "ice": {{"friction": {friction}}}}}"#
                );
                let mut sim = Simulation::new(bare(&scene)).expect("a start");
                let (n, mass) = (sim.model.n, sim.model.mass());
                for _ in 0..20 {
                    let (mut q, mut v): ([f64; NV], [f64; NV]) =
                        (draw(&mut rng, n, 0.3), draw(&mut rng, n, 3.0));
                    q[..3].fill(0.0);
                    v[..3].copy_from_slice(&[rng.random_range(1.0..5.0), 0.0, 0.0]);
                    if sim.reset(&q, &v, Default::default()).is_err() {
                        continue;
                    }
                    for _ in 0..10 {
                        sim.hold(&torques(&mut rng, n, 50.0));
                        let (start, before) = (Whole::of(&sim), sim.clone());
                        sim.take_events();
                        sim.advance(before.state.t + 0.2 * step);
                        let mode = sim.state.mode;
                        let one_step = sim.stats.steps == before.stats.steps + 1;
                        if sim.ended.is_some() || !sim.take_events().is_empty() || !one_step {
                            break;
                        }
                        if !mode.support.slides() || mode.support.touch == SoleContact::Air {
                            continue;
                        }
                        if mode.free.touch != SoleContact::Air && !mode.free.slides() {
                            continue;
                        }
                        let force = sim.eval.solution.f_root[0] + sim.eval.solution.lam[0];
                        let impulse = 0.2 * step * force;
                        let change = Whole::of(&sim).momentum[0] - start.momentum[0];
                        worst = worst.max((change - impulse).abs() / mass);
                        steps += 1;
                    }
                }
            }
        }
    }
    assert!(steps > 200, "{steps}");
    // Measured 4e-15 m/s.
    assert!(worst < 1e-9, "{worst}");
}

/// The error falls with the step down to 0.02 ms, and the number of events does not depend on it: in a fall from 2 cm
/// onto both feet, whose heels lift later, and where a free foot lands in two-way contact.
#[test]
fn shorter_steps_are_more_accurate() {
    let mut rng = ChaCha8Rng::seed_from_u64(3);
    let mut lifts = 0;
    for k in 0..8 {
        let (law, height, bent) = match k % 2 {
            0 => ("push_only", 0.02, 0.0),
            _ => ("two_way", 0.0, 0.1),
        };
        let (a, speed) = (rng.random_range(0.1..0.4), rng.random_range(1.0..2.5));
        let b = a + bent;
        let end = |step: f64| {
            let scene = format!(
                r#"{{"accuracy": {{"method": "moreau", "step": {step}}}, "contact": {{"law": "{law}"}},
                    "ice": {{"friction": {{"capture_speed": 0}}}},
                    "start": {{"v": {{"y0": {speed}}}, "q": {{"z0": {height},
                    "q2": {}, "q3": {}, "q4": {}, "q5": {b}, "q6": {}, "q7": {b}}}}}}}"#,
                -a,
                2.0 * a,
                -a,
                -2.0 * b
            );
            let mut sim = Simulation::new(bare(&scene)).expect("a start");
            sim.advance(0.25);
            assert_eq!(sim.ended, None);
            (sim.head(), sim.take_events())
        };
        // Events that two feet have at the same instant have another order in event-driven methods.
        let (exact, _) = end(1e-5);
        let mut before: Option<(f64, usize)> = None;
        for step in [4e-4, 2e-4, 1e-4, 5e-5, 2e-5] {
            let (head, events) = end(step);
            let pairs = head.iter().zip(exact);
            let error = pairs.map(|(a, b)| (a - b).abs()).fold(0.0, f64::max);
            if let Some((larger, count)) = before {
                // Measured at most 0.34, and 1e-10 to 9e-10 m for the shortest.
                assert!(error < 0.5 * larger + 1e-9, "{step} s: {larger} {error}");
                assert_eq!(events.len(), count, "{step} s");
            }
            lifts += usize::from(events.iter().any(|event| event.what.contains("lifts")));
            before = Some((error, events.len()));
        }
    }
    assert!(lifts >= 10, "{lifts}");
}

/// Impacts, the stop of a foot that becomes the supporting one and the friction of every step take energy, at any length
/// of steps; friction up to 1 J/s2 times the square of a step. Friction of feet that reverse within a step has added up
/// to 60 J.
#[test]
fn impacts_and_friction_dissipate() {
    let mut rng = ChaCha8Rng::seed_from_u64(4);
    let presets = [
        include_str!("../../../../skate_env/scenes/paper.toml"),
        include_str!("../../../../skate_env/scenes/paper_arms.toml"),
        include_str!("../../../../skate_env/scenes/push_only.toml"),
    ];
    let mut worst = [0.0_f64; 2];
    for (preset, step) in presets
        .iter()
        .flat_map(|preset| [(preset, 1e-3), (preset, 5e-3)])
    {
        let mut scene = Scene::from_toml(preset).expect("a scene");
        let accuracy = format!(r#"{{"method": "moreau", "step": {step}}}"#);
        scene.accuracy = serde_json::from_str(&accuracy).expect("an accuracy");
        let mut sim = Simulation::new(Model::compile(&scene).expect("a model")).expect("a start");
        let (n, start) = (sim.model.n, sim.state);
        let mut lost = 0.0_f64;
        for _ in 0..40 {
            sim.check(true);
            sim.reset(&start.q, &start.v, start.support_leg)
                .expect("a start");
            for _ in 0..150 {
                let before = sim.state.energy_balance;
                sim.hold(&torques(&mut rng, n, 80.0));
                sim.advance(sim.next_action_time());
                if sim.ended.is_some() {
                    break;
                }
                let after = sim.state.energy_balance;
                let changes = [
                    after.impacts - before.impacts,
                    (after.friction - before.friction) / (step * step),
                ];
                for (worst, change) in worst.iter_mut().zip(changes) {
                    *worst = worst.max(-change);
                }
                lost = lost.max(changes[0]);
            }
            assert_eq!(sim.broken_laws().next(), None);
        }
        assert!(lost > 1.0, "{lost} J");
    }
    let [impacts, friction] = worst;
    // Measured 4e-7 J and 4e-7 J/s2; an action has up to ten steps of two feet.
    assert!(impacts < 1e-6 && friction < 20.0, "{worst:?}");
}
