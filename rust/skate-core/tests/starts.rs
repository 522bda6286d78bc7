//! The state of any motion is a start: `reset` gives its coordinates, leg and contacts, bit for bit. A state in single
//! precision gives the same contacts.

mod presets;

use presets::PRESETS;
use rand::{Rng, SeedableRng};
use rand_chacha::ChaCha8Rng;
use skate_core::{
    model::{
        Model,
        contact_mode::{SoleContact, touches},
        layout::{NV, ROOT},
    },
    scene::{Accuracy, AccuracyName, Scene, effects::EFFECTS},
    sim::{Coordinates, Simulation},
    task::perturbed,
};
use std::collections::BTreeSet;

const MOTIONS: u32 = 400;
/// At looser tolerances a normal force may have the other sign for an instant.
const EXACT: Accuracy = Accuracy::Tolerance(5e-6);

/// A preset with some effects toggled, if it has a start.
fn drawn_scene(rng: &mut ChaCha8Rng, accuracy: Accuracy, is_controlled: bool) -> Option<Scene> {
    let preset = PRESETS[rng.random_range(0..PRESETS.len())];
    let mut scene = Scene::from_toml(preset).expect("a preset");
    for _ in 0..rng.random_range(0..4) {
        let effect = &EFFECTS[rng.random_range(0..EFFECTS.len())];
        let toggled = match effect.is_on(&scene) {
            true => scene.without(effect.name),
            false => scene.with(effect.name),
        };
        scene = toggled.unwrap_or(scene);
    }
    if !is_controlled {
        scene.control.lifting = None;
        scene.control.feedforward = None;
        scene.stabilizers = Default::default();
    }
    scene.accuracy = accuracy;
    scene.energy_balance = true;
    Some(scene)
}

/// Call `check` at random times of drawn motions under random torques, which have just ended.
fn visit(accuracy: Accuracy, is_controlled: bool, mut check: impl FnMut(&Simulation)) {
    let mut rng = ChaCha8Rng::seed_from_u64(11);
    for seed in 0..MOTIONS {
        let scene = drawn_scene(&mut rng, accuracy, is_controlled);
        let model = scene.and_then(|scene| Model::compile(&scene).ok());
        let Some(mut sim) = model.and_then(|model| Simulation::new(model).ok()) else {
            continue;
        };
        // A start far from the gait tumbles. Without a valid draw the start is the scene's.
        let noise = [0.0, 0.02, 0.3][rng.random_range(0..3)];
        perturbed(&mut sim, noise, seed.into()).ok();
        let size = [0.0, 20.0, 100.0][rng.random_range(0..3)];
        let joints = sim.model.n - ROOT;
        for _ in 0..60 {
            let torques = (0..joints).map(|_| size * rng.random_range(-1.0..=1.0));
            sim.hold(&torques.collect::<Vec<f64>>());
            sim.advance(sim.state.t + rng.random_range(0.0..0.02));
            let mut visited = sim.clone();
            visited.hold(&vec![0.0; joints]);
            if visited.ended.is_some() {
                break;
            }
            check(&visited);
        }
    }
}

fn restarted(sim: &Simulation, Coordinates { q, v }: Coordinates) -> Simulation {
    let mut again = sim.clone();
    let name = sim.state.mode.name();
    again
        .reset(&q, &v, sim.state.support_leg)
        .unwrap_or_else(|why| panic!("{name}: {why}"));
    again
}

/// Heights of the ends of both soles in order, which do not depend on the roles of the legs.
fn heights(sim: &Simulation) -> Vec<f64> {
    let mut heights = sim.sole_points.gaps.concat();
    heights.sort_by(f64::total_cmp);
    heights
}

/// Largest difference of two lists.
fn difference(a: &[f64], b: &[f64]) -> f64 {
    let pairs = a.iter().zip(b);
    pairs.map(|(a, b)| (a - b).abs()).fold(0.0, f64::max)
}

/// Energy that impacts at the start have dissipated [J].
fn dissipated(sim: &Simulation) -> f64 {
    let balance = sim.state.energy_balance;
    balance.impacts + balance.capture
}

/// Without a controller, bit for bit in every contact law and mode.
#[test]
fn the_state_of_a_motion_is_a_start() {
    let mut seen = BTreeSet::new();
    visit(EXACT, false, |sim| {
        let again = restarted(sim, sim.coordinates());
        assert_eq!(again.coordinates(), sim.coordinates());
        assert_eq!(again.state.support_leg, sim.state.support_leg);
        assert_eq!(again.state.mode, sim.state.mode);
        let contacts = format!("{:?}", touches(sim.state.mode));
        seen.insert((contacts, sim.model.contact.is_push_only));
    });
    assert!(seen.len() >= 14, "{seen:?}");
}

/// A controller starts anew, and other forces may open contacts at once. The coordinates stay, but for an impact where a
/// foot is wedged: 29 of 20,569 starts. Largest change: 1.3e-9 rad/s, where a heel has just left the ice.
#[test]
fn the_state_of_a_controlled_motion_is_a_start() {
    let (mut starts, mut impacts) = (0, 0);
    visit(EXACT, true, |sim| {
        let again = restarted(sim, sim.coordinates());
        assert!(difference(&heights(&again), &heights(sim)) < 1e-12);
        let (before, after) = (sim.energy(), again.energy());
        assert!((after + dissipated(&again) - before).abs() < 1e-9 * before);
        starts += 1;
        if dissipated(&again).abs() > 1e-6 {
            impacts += 1;
        } else if again.state.support_leg == sim.state.support_leg {
            let (found, given) = (again.coordinates(), sim.coordinates());
            let apart = difference(&found.q, &given.q).max(difference(&found.v, &given.v));
            assert!(apart < 1e-8, "{apart}");
        }
    });
    assert!(impacts < starts / 300, "{impacts} of {starts}");
}

/// Time steps leave velocities of closed ends of 0.2 m/s and heights of 1e-9 m, which a start keeps: residual 3e-14 m. At
/// 14 of 11,233 starts an impact of at most 3e-6 J, or of a wedged foot, follows at once.
#[test]
fn the_state_of_time_steps_is_a_start() {
    let (mut starts, mut impacts) = (0, 0);
    visit(Accuracy::Named(AccuracyName::Fast), false, |sim| {
        let again = restarted(sim, sim.coordinates());
        starts += 1;
        if dissipated(&again).abs() > 1e-11 {
            impacts += 1;
            return;
        }
        assert!(difference(&heights(&again), &heights(sim)) < 1e-9);
        if again.state.support_leg == sim.state.support_leg {
            let (found, given) = (again.coordinates(), sim.coordinates());
            let apart = difference(&found.q, &given.q).max(difference(&found.v, &given.v));
            assert!(apart < 1e-12, "{apart}");
        }
    });
    assert!(impacts < starts / 500, "{impacts} of {starts}");
}

/// In single precision: the same contacts, on which the state is projected.
///
/// Residuals: 2e-6 m or rad, 7e-5 m/s or rad/s.
#[test]
fn a_state_in_single_precision_is_a_start() {
    let rounded = |x: f64| f64::from(x as f32);
    visit(EXACT, false, |sim| {
        let Coordinates { q, v } = sim.coordinates();
        let (q, v) = (q.map(rounded), v.map(rounded));
        let again = restarted(sim, Coordinates { q, v });
        let found = again.coordinates();
        assert_eq!(touches(again.state.mode), touches(sim.state.mode));
        assert_eq!(again.state.support_leg, sim.state.support_leg);
        assert!(difference(&found.q, &q) < 1e-5);
        assert!(difference(&found.v, &v) < 5e-4);
    });
}

/// y0 and z0 of a start are those of the toe, also of a foot that stands on its heel.
#[test]
fn a_start_on_the_heel_is_given_by_its_toe() {
    let scene = Scene::from_toml(PRESETS[4]).expect("push_only");
    let mut sim = Simulation::new(Model::compile(&scene).expect("a model")).expect("a start");
    let (length, leg) = (sim.model.sole.length(), sim.state.support_leg);
    let (s, c) = 0.2_f64.sin_cos();
    let (mut q, mut v) = ([0.0; NV], [0.0; NV]);
    (q[0], q[1], q[2], q[6]) = (0.3, length * s, 0.2, 0.9);
    (v[1], v[2]) = (-0.5 * length * c, -0.5);
    sim.reset(&q, &v, leg).expect("a heel on the ice");
    assert_eq!(sim.state.mode.support.touch, SoleContact::Heel);
    assert!((sim.state.q[0] - (q[0] - length * c)).abs() < 1e-15);
    assert_eq!([sim.state.q[1], sim.state.v[1]], [0.0; 2]);
    let found = sim.coordinates();
    assert!(difference(&found.q, &q).max(difference(&found.v, &v)) < 1e-15);
    q[1] = 0.0;
    let refused = sim.reset(&q, &v, leg).expect_err("a heel below the ice");
    assert!(refused.0.contains("supporting heel starts"), "{refused}");
}
