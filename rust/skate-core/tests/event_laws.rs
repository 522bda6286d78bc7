//! Laws of events: feet that stop together, forces that change sign, soles that lie upside down, wedged feet.

mod checked;

use checked::assert_laws;
use rand::{Rng, SeedableRng};
use rand_chacha::ChaCha8Rng;
use skate_core::{
    model::{
        Model,
        contact_mode::{FREE, SUPPORT, SoleContact},
        layout::{NV, ROOT},
    },
    scene::{ContactLaw, Friction, Leg, PulledFriction, Scene},
    sim::Simulation,
};

const PAPER_PRINTED: &str = include_str!("../../../skate_env/scenes/paper_printed.toml");

fn simulation(scene: &Scene) -> Simulation {
    Simulation::new(Model::compile(scene).expect("a model")).expect("a start")
}

/// Push-only ice. A robot whose legs mirror each other slides on both feet, which stop at the same instant: one of them
/// used to keep its direction, and friction pushed it.
#[test]
fn feet_that_stop_at_the_same_instant_are_not_pushed() {
    let mut rng = ChaCha8Rng::seed_from_u64(1);
    let mut scene = Scene::default();
    scene.contact.law = ContactLaw::PushOnly;
    scene.energy_balance = true;
    let mut stopped = 0;
    for _ in 0..40 {
        let mut sim = simulation(&scene);
        let (mut q, mut v) = ([0.0; NV], [0.0; NV]);
        let [a, b] = [rng.random_range(0.1..0.5), rng.random_range(0.2..0.8)];
        q[3..9].copy_from_slice(&[-a, b, a - b, b - a, -b, a]);
        (v[0], v[10]) = (rng.random_range(-0.5..0.5), rng.random_range(-1.0..1.0));
        sim.reset(&q, &v, Leg::Left).expect("a start");
        sim.check(true);
        for part in 1..=20 {
            sim.advance(0.005 * f64::from(part));
        }
        assert_laws(&sim);
        let stops = |which| {
            move |event: &skate_core::sim::Event| event.to.foot(which) != event.from.foot(which)
        };
        let events = sim.take_events();
        stopped += usize::from(
            [SUPPORT, FREE]
                .into_iter()
                .all(|which| events.iter().any(stops(which))),
        );
    }
    assert!(stopped > 10, "{stopped}");
}

/// Where friction keeps the sign of a normal force that pulls, random torques used to end in joint rates of 1e6 rad/s.
/// Now friction of such a foot ends where no mode is consistent with it.
#[test]
fn a_pulled_foot_with_literal_friction_does_not_run_away() {
    let mut rng = ChaCha8Rng::seed_from_u64(2);
    let mut causes = Vec::new();
    let mut fastest: f64 = 0.0;
    for _ in 0..20 {
        let mut scene = Scene::from_toml(PAPER_PRINTED).expect("the preset");
        assert_eq!(scene.contact.pulled_friction, PulledFriction::Literal);
        scene.energy_balance = true;
        scene.ice.gravity = rng.random_range(5.0..20.0);
        scene.ice.friction = Friction::Directional {
            mu_forward: rng.random_range(0.0..1.0),
            mu_backward: rng.random_range(0.0..1.5),
            capture_speed: 0.01,
        };
        let mut sim = simulation(&scene);
        sim.check(true);
        while sim.state.t < 5.0 && sim.ended.is_none() {
            let torques: [f64; NV] = std::array::from_fn(|_| rng.random_range(-20.0..20.0));
            sim.hold(&torques[..sim.model.n - ROOT]);
            sim.advance(sim.next_action_time());
            let rates = &sim.state.v[2..sim.model.n];
            fastest = rates
                .iter()
                .fold(fastest, |most, rate| most.max(rate.abs()));
        }
        assert_laws(&sim);
        causes.push(sim.ended);
    }
    println!("{fastest} rad/s, {causes:?}");
    assert!(fastest < 1e3, "{fastest}");
}

/// Push-only ice without fall detection: drawn robots tumble, and soles come to lie upside down. Such a foot used to be
/// turned to q1 = 0 at once, by which the head jumped.
#[test]
fn a_sole_may_lie_upside_down() {
    let mut rng = ChaCha8Rng::seed_from_u64(3);
    let mut upside_down = 0;
    for _ in 0..60 {
        let mut scene = Scene::default();
        scene.contact.law = ContactLaw::PushOnly;
        scene.energy_balance = true;
        let mut sim = simulation(&scene);
        let mut q = [0.0; NV];
        let sign = if rng.random() { 1.0 } else { -1.0 };
        (q[1], q[2]) = (1.2, sign * rng.random_range(2.4..3.0));
        q[3..9].copy_from_slice(&std::array::from_fn::<f64, 6, _>(|_| {
            rng.random_range(-0.3..0.3)
        }));
        sim.reset(&q, &[0.0; NV], Leg::Left).expect("a start");
        sim.check(true);
        while sim.state.t < 1.5 && sim.ended.is_none() {
            sim.advance(sim.next_action_time());
            let angles = [sim.state.q[2], sim.state.free_foot_angle()];
            let feet = [sim.state.mode.support, sim.state.mode.free];
            let lies = |(foot, angle): (skate_core::model::contact_mode::Foot, f64)| {
                foot.touch == SoleContact::Flat && angle.cos() < 0.0
            };
            upside_down += usize::from(feet.into_iter().zip(angles).any(lies));
        }
        assert_laws(&sim);
    }
    println!("{upside_down}");
    assert!(upside_down > 20, "{upside_down}");
}
