//! A kick adds the same velocity to all bodies and changes nothing else.

use super::bare;
use skate_core::{
    model::{Model, contact_mode::SoleContact},
    scene::{ContactLaw, Scene},
    sim::Simulation,
};

const PRESETS: [&str; 6] = [
    include_str!("../../../../skate_env/scenes/paper_printed.toml"),
    include_str!("../../../../skate_env/studies/scenes/paper_damped.toml"),
    include_str!("../../../../skate_env/scenes/paper_arms.toml"),
    include_str!("../../../../skate_env/studies/scenes/blade.toml"),
    include_str!("../../../../skate_env/scenes/push_only.toml"),
    include_str!("../../../../skate_env/scenes/paper.toml"),
];

/// Linear momentum along y [kg m/s].
fn momentum(sim: &Simulation) -> f64 {
    let eval = sim.full_kinematics();
    eval.inertias.momentum(&sim.model, &eval.kin).0[0]
}

/// Largest vertical speed of a sole end on the ice [m/s].
fn max_vertical_speed(sim: &Simulation) -> f64 {
    let feet = [sim.state.mode.support, sim.state.mode.free];
    let mut fastest: f64 = 0.0;
    for (foot, [heel, toe]) in feet.iter().zip(sim.sole_points.speeds) {
        for (down, end) in [(foot.touch.heel(), heel), (foot.touch.toe(), toe)] {
            if down {
                fastest = fastest.max(end[1].abs());
            }
        }
    }
    fastest
}

/// Smallest forward velocity of a sole end on the ice [m/s].
fn min_forward_speed(sim: &Simulation) -> f64 {
    let feet = [sim.state.mode.support, sim.state.mode.free];
    let touching = feet.iter().zip(sim.sole_points.speeds);
    let along = touching
        .filter(|(foot, _)| foot.touch != SoleContact::Air)
        .flat_map(|(_, ends)| ends.map(|end| end[0]));
    along.fold(f64::INFINITY, f64::min)
}

/// Momentum of the robot at 16 m/s [N s]; measured 370.
const MOST_IMPULSE: f64 = 1e3;

/// Largest deviations from the expected changes.
#[derive(Debug, Default)]
struct Worst {
    momentum: f64,
    energy: f64,
    max_vertical_speed: f64,
    gap: f64,
    kicks: u32,
    /// Kicks that cause an impact with friction because no contact force is consistent with sliding
    /// (Painleve paradox).
    with_impact: u32,
}

fn kick(before: &Simulation, speed: f64, worst: &mut Worst) {
    let mut sim = before.clone();
    sim.kick(speed).expect("a kick");
    assert_eq!(sim.ended, None);
    worst.kicks += 1;
    let unaccounted_energy = sim.energy_residual() - before.energy_residual();
    worst.energy = worst.energy.max(unaccounted_energy.abs());
    worst.max_vertical_speed = worst
        .max_vertical_speed
        .max(max_vertical_speed(&sim) - max_vertical_speed(before));
    let lost = sim.state.energy_balance.impacts - before.state.energy_balance.impacts;
    assert!(lost > -1e-9, "an impact adds {} J", -lost);
    // A foot that becomes the supporting one loses the rest of its vertical motion.
    let stopped = match sim.state.support_leg == before.state.support_leg {
        true => 0.0,
        false => 1e-12 + MOST_IMPULSE * max_vertical_speed(before),
    };
    if lost.abs() > stopped {
        // Among the presets only backward sliding has enough friction for that.
        assert!(min_forward_speed(before) + speed < 0.0);
        worst.with_impact += 1;
        return;
    }
    let gained = momentum(&sim) - momentum(before);
    let wanted = sim.model.mass() * speed;
    worst.momentum = worst.momentum.max((gained / wanted - 1.0).abs());
    let (old, new) = (&before.state, &sim.state);
    assert_eq!(new.t, old.t);
    if (new.support_leg, new.mode.support.touch) == (old.support_leg, old.mode.support.touch) {
        // The coordinates do not change, except that a pivot within 3e-13 m of the ice is placed on it.
        let on_ice = new.q[1] == 0.0 && old.q[1].abs() < 1e-12;
        assert!(new.q[1] == old.q[1] || on_ice, "{}", old.q[1]);
        assert_eq!((new.q[0], &new.q[2..]), (old.q[0], &old.q[2..]));
        assert_eq!(new.v[1..], old.v[1..]);
        assert_eq!(new.v[0], old.v[0] + speed);
        for (new, old) in sim.sole_points.gaps.iter().zip(before.sole_points.gaps) {
            for (new, old) in new.iter().zip(old) {
                worst.gap = worst.gap.max((new - old).abs());
            }
        }
    }
    let along = [new.v[0], sim.eval.point_velocity[0]];
    for (foot, along) in [new.mode.support, new.mode.free].iter().zip(along) {
        if foot.touch != SoleContact::Air {
            assert_eq!(
                foot.friction_mode.sign(),
                along.signum(),
                "{foot:?} at {along} m/s"
            );
        }
    }
    assert_eq!(
        sim.since_event() == 0.0,
        new.mode != old.mode || before.since_event() == 0.0
    );
}

/// For all phases of the gait: the linear momentum changes by mass times speed, velocities relative to the
/// foot and heights do not change, the energy balance includes the kick, and feet on the ice stay on it.
#[test]
fn a_kick_adds_the_same_velocity_to_all_bodies() {
    for preset in PRESETS {
        for accuracy in [r#""balanced""#, r#""fast""#] {
            let mut scene = Scene::from_toml(preset).expect("the preset");
            scene.accuracy = serde_json::from_str(accuracy).expect("an accuracy");
            let model = Model::compile(&scene).expect("a model");
            let mut sim = Simulation::new(model).expect("a start");
            let mut worst = Worst::default();
            while sim.state.t < 1.5 && sim.ended.is_none() {
                for speed in [0.3, -0.3, 9.0, -9.0] {
                    kick(&sim, speed, &mut worst);
                }
                sim.advance(sim.next_action_time());
            }
            println!("{} {accuracy}: {worst:?}", scene.name);
            // Measured at most 1.5e-14, 2e-10 J, 7e-15 m/s and 4e-13 m; 125 of 600 kicks cause an impact.
            assert!(worst.momentum < 1e-12, "{worst:?}");
            assert!(worst.energy < 1e-9, "{worst:?}");
            assert!(worst.max_vertical_speed < 1e-12, "{worst:?}");
            assert!(worst.gap < 1e-12, "{worst:?}");
            assert!(4 * worst.with_impact <= worst.kicks, "{worst:?}");
        }
    }
}

/// In flight, a kick and its opposite cancel up to rounding of the speed.
#[test]
fn opposite_kicks_cancel_in_flight() {
    for accuracy in [r#""balanced""#, r#""fast""#] {
        let scene = format!(
            r#"{{"accuracy": {accuracy}, "contact": {{"law": "push_only"}},
                "start": {{"q": {{"z0": 0.5, "q2": 0.4, "q3": -0.3}}, "v": {{"y0": 1.0, "q5": 2.0}}}}}}"#
        );
        let mut sim = Simulation::new(bare(&scene)).expect("a start");
        sim.advance(0.05);
        let before = sim.clone();
        for speed in [0.7, -2.3] {
            sim.kick(speed).expect("a kick");
            assert!((sim.state.v[0] - before.state.v[0] - speed).abs() < 1e-15);
            sim.kick(-speed).expect("a kick back");
            // Measured 0 m/s and 7e-14 J.
            assert!((sim.state.v[0] - before.state.v[0]).abs() < 1e-14);
            assert!(
                sim.state.energy_balance.kicks.abs() < 1e-11,
                "{:?}",
                sim.state.energy_balance
            );
        }
        let (mut now, then) = (sim.state, before.state);
        (now.v[0], now.energy_balance.kicks) = (then.v[0], then.energy_balance.kicks);
        assert_eq!(now, then);
        assert_eq!(sim.stats.events, before.stats.events);
    }
}

/// Both soles flat on the ice, at rest.
fn standing(law: ContactLaw) -> Simulation {
    let mut scene = Scene::default();
    scene.contact.law = law;
    for (joint, q) in [
        ("q2", -0.1),
        ("q3", 0.2),
        ("q4", -0.1),
        ("q5", 0.1),
        ("q6", -0.2),
        ("q7", 0.1),
    ] {
        scene.start.q.insert(joint.into(), q);
    }
    Simulation::new(Model::compile(&scene).expect("a model")).expect("a start")
}

/// Two sticking feet slide after a kick until friction stops them. A kick below the capture speed leaves
/// them at rest.
#[test]
fn sticking_feet_slide_after_a_kick() {
    for law in [ContactLaw::TwoWay, ContactLaw::PushOnly] {
        let mut sim = standing(law);
        sim.advance(0.01);
        let feet = |sim: &Simulation| {
            [sim.state.mode.support, sim.state.mode.free].map(|foot| foot.friction_mode.sign())
        };
        assert_eq!((sim.ended, feet(&sim)), (None, [0.0; 2]));
        sim.kick(1e-10).expect("a kick");
        assert_eq!(
            (sim.ended, feet(&sim), sim.state.v[0]),
            (None, [0.0; 2], 0.0)
        );
        for speed in [0.5, -0.9] {
            sim.kick(speed).expect("a kick");
            assert_eq!((sim.ended, feet(&sim)), (None, [speed.signum(); 2]));
            assert_eq!(sim.since_event(), 0.0);
            let event = sim.take_events().pop().expect("an event");
            assert_eq!((event.what, event.to), ("kick", sim.state.mode));
        }
    }
}

/// A terminated simulation, a zero kick and a refused kick change nothing.
#[test]
fn zero_and_refused_kicks_change_nothing() {
    let mut sim = standing(ContactLaw::TwoWay);
    sim.advance(0.01);
    let before = sim.snapshot();
    for zero in [0.0, -0.0, 5e-324] {
        sim.kick(zero).expect("no kick");
    }
    for wrong in [f64::NAN, f64::INFINITY, 10.1, -1e300] {
        let why = sim.kick(wrong).expect_err("no kick");
        assert!(why.0.contains("must lie in [-10, 10] m/s"), "{why}");
    }
    assert!(sim.snapshot() == before);
    sim.ended = Some(skate_core::error::Termination::Fall);
    let before = sim.snapshot();
    sim.kick(1.0).expect("no error");
    assert!(sim.snapshot() == before);
    let scene = Scene::default()
        .without("slipping")
        .expect("feet can stick");
    let mut sim = Simulation::new(Model::compile(&scene).expect("a model")).expect("a start");
    let before = sim.snapshot();
    let why = sim.kick(1.0).expect_err("no foot can slide");
    assert!(why.0.contains("must be 0 on sticking ice"), "{why}");
    assert!(sim.snapshot() == before);
}
