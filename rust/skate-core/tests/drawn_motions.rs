//! Laws of drawn motions: perturbed starts of the presets under random torques.

mod checked;
mod presets;

use checked::assert_laws;
use presets::PRESETS;
use rand::{Rng, SeedableRng};
use rand_chacha::ChaCha8Rng;
use skate_core::{
    model::{
        Model,
        layout::{NV, ROOT},
    },
    scene::{Accuracy, AccuracyName, Scene},
    sim::Simulation,
    task::perturbed,
};

/// Motions of each preset and accuracy.
const MOTIONS: u64 = 6;
/// Actions of 0.01 s of a motion.
const ACTIONS: usize = 200;

/// Torques of one action [N m].
type Torques = [f64; NV];

/// A perturbed start, and torques up to a size that is drawn between 1 and 100 N m.
fn motion(text: &str, accuracy: Accuracy, seed: u64) -> (Simulation, Vec<Torques>) {
    let mut scene = Scene::from_toml(text).expect("a scene");
    scene.accuracy = accuracy;
    scene.energy_balance = true;
    let mut sim = Simulation::new(Model::compile(&scene).expect("a model")).expect("a start");
    perturbed(&mut sim, 0.02, seed).expect("a start");
    let mut rng = ChaCha8Rng::seed_from_u64(seed);
    let size = 10_f64.powf(rng.random_range(0.0..2.0));
    let draw = |_| std::array::from_fn(|_| rng.random_range(-size..size));
    (sim, (0..ACTIONS).map(draw).collect())
}

fn act(sim: &mut Simulation, torques: &Torques, calls: u32) {
    let joints = sim.model.n - ROOT;
    sim.hold(&torques[..joints]);
    let (start, until) = (sim.state.t, sim.next_action_time());
    for call in 1..calls {
        sim.advance(start + (until - start) * f64::from(call) / f64::from(calls));
    }
    sim.advance(until);
}

/// Every law, with the methods that locate events.
fn assert_drawn_motions_keep(text: &str) {
    for name in [AccuracyName::Balanced, AccuracyName::Reference] {
        for seed in 0..MOTIONS {
            let (mut sim, torques) = motion(text, Accuracy::Named(name), seed);
            sim.check(true);
            for torques in &torques {
                act(&mut sim, torques, 1);
            }
            assert_laws(&sim);
        }
    }
}

/// Push-only contact up to a fall. Largest amounts measured, `balanced` and `reference`: friction 1e-8 and 2e-9 J, impacts
/// 6e-9 J, balance 2e-4 and 3e-9 J, momentum 1e-6 and 6e-11 m/s, forces 1e-6 N, direction 2e-12 m/s, ice 1e-11 m,
/// positions 1e-8 m.
#[test]
fn drawn_motions_of_push_only_contact_keep_every_law() {
    for text in PRESETS.iter().filter(|text| text.contains("push_only")) {
        assert_drawn_motions_keep(text);
    }
}

/// Two-way contact. Measured: friction 2e-5 and 2e-9 J, balance 4e-4 and 2e-9 J, normal forces 3e-3 and 1e-6 N, direction
/// 2e-12 m/s, forces where one changes its sign 3e-5 N, positions 6e-11 m.
#[test]
fn drawn_motions_of_two_way_contact_keep_every_law() {
    for text in PRESETS.iter().filter(|text| !text.contains("push_only")) {
        assert_drawn_motions_keep(text);
    }
}

/// A motion does not depend on the number of calls that make it, up to the method's tolerance.
#[test]
fn one_call_and_a_hundred_short_ones_agree() {
    let accuracy = Accuracy::Tolerance(1e-9);
    let mut worst: f64 = 0.0;
    for text in PRESETS {
        for seed in 0..4 {
            let (mut whole, torques) = motion(text, accuracy, seed);
            let mut parts = whole.clone();
            for torques in &torques[..10] {
                act(&mut whole, torques, 1);
                act(&mut parts, torques, 100);
            }
            assert_eq!(whole.ended, parts.ended);
            assert_eq!(whole.state.mode, parts.state.mode);
            let pairs = whole.state.q.iter().zip(&parts.state.q);
            worst = pairs.map(|(a, b)| (a - b).abs()).fold(worst, f64::max);
        }
    }
    // 1.4e-10 measured.
    assert!(worst < 1e-8, "{worst:e}");
}
