//! Friction and contact laws of the ice.

use skate_core::{
    dynamics::bias_forces,
    model::{Model, contact_mode::SoleContact},
    scene::{Accuracy, Friction, Scene},
    sim::Simulation,
};

const PAPER: &str = include_str!("../../../skate_env/scenes/paper_printed.toml");
const BLADE: &str = include_str!("../../../skate_env/studies/scenes/blade.toml");

fn simulation(scene: &Scene) -> Simulation {
    Simulation::new(Model::compile(scene).expect("a valid scene")).expect("a start")
}

/// The preset with push-only contact, with another friction law.
fn blade(friction: Friction) -> Scene {
    let mut scene = Scene::from_toml(BLADE).expect("the preset");
    scene.ice.friction = friction;
    scene.accuracy = Accuracy::Tolerance(1e-11);
    scene
}

/// Linear momentum along y [kg m/s].
fn momentum(sim: &Simulation) -> f64 {
    let eval = sim.full_kinematics();
    eval.inertias.momentum(&sim.model, &eval.kin).0[0]
}

/// Error of the energy balance: unaccounted energy [J].
fn unaccounted_energy(sim: &Simulation) -> f64 {
    let eval = sim.full_kinematics();
    let (kinetic, potential) =
        bias_forces::energy(&sim.model, &eval.kin, &sim.state.v, sim.state.q[1]);
    let l = sim.state.energy_balance;
    kinetic + potential - (l.actuators - l.damping - l.friction - l.impacts - l.capture)
}

/// Without friction the momentum along the ice is conserved, including landings and rolling feet.
#[test]
fn frictionless_ice_conserves_momentum() {
    let mut sim = simulation(&blade(Friction::None {}));
    let start = momentum(&sim);
    sim.advance(1.0);
    assert!(sim.stats.events > 4, "{:?}", sim.stats);
    let change = (momentum(&sim) - start).abs() / start;
    // Measured 7e-11.
    assert!(change < 1e-9, "{change:e}");
}

/// Viscous friction removes momentum in proportion to the foot's displacement: p + c y0 is conserved.
#[test]
fn viscous_friction_removes_momentum_per_displacement() {
    let coefficient = 30.0;
    let mut scene = Scene {
        accuracy: Accuracy::Tolerance(1e-11),
        ..Scene::default()
    };
    scene.ice.friction = Friction::Viscous { coefficient };
    for (joint, q) in [
        ("q2", 0.1),
        ("q3", -0.2),
        ("q5", 0.6),
        ("q6", -0.9),
        ("q7", 0.4),
    ] {
        scene.start.q.insert(joint.into(), q);
    }
    scene.start.v.insert("y0".into(), 3.0);
    let mut sim = simulation(&scene);
    let start = momentum(&sim);
    sim.advance(0.15);
    assert_eq!((sim.stats.events, sim.state.mode.number()), (0, 3));
    let kept = momentum(&sim) + coefficient * sim.state.q[0];
    // Measured 2e-10 of the momentum, of which one twentieth is removed.
    assert!((kept / start - 1.0).abs() < 1e-8, "{kept} {start}");
    assert!(momentum(&sim) < 0.97 * start, "{} {start}", momentum(&sim));
}

/// The energy balance closes for every friction law.
#[test]
fn the_energy_balance_closes_for_every_friction_law() {
    let paper = |friction| {
        let mut scene = Scene::from_toml(PAPER).expect("the preset");
        scene.ice.friction = friction;
        scene.accuracy = Accuracy::Tolerance(1e-11);
        scene
    };
    let coulomb = Friction::Coulomb {
        mu: 0.1,
        capture_speed: 0.01,
    };
    let scenes = [
        blade(Friction::None {}),
        blade(coulomb),
        blade(Friction::PAPER),
        paper(Friction::Viscous { coefficient: 20.0 }),
        paper(Friction::None {}),
    ];
    for scene in scenes {
        let friction = scene.ice.friction;
        let mut sim = simulation(&scene);
        let start = unaccounted_energy(&sim);
        let mut largest: f64 = 0.0;
        while sim.state.t < 1.0 && sim.ended.is_none() {
            let next = sim.state.t + 0.01;
            sim.advance(next);
            largest = largest.max((unaccounted_energy(&sim) - start).abs());
        }
        println!("{friction:?}: {largest:e} J after {:.2} s", sim.state.t);
        assert!(sim.state.t > 0.3 && sim.stats.events > 4, "{:?}", sim.ended);
        // Measured at most 1e-8 J; the kinetic energy is about 1,000 J.
        assert!(largest < 1e-6, "{friction:?}: {largest:e} J");
    }
}

/// On sticking ice the feet do not slide under any torque.
#[test]
fn feet_do_not_slide_on_sticking_ice() {
    let scene = Scene::from_toml(PAPER).expect("the preset");
    let scene = scene.without("slipping").expect("feet can stick");
    let mut sim = simulation(&scene);
    sim.advance(0.3);
    assert_eq!(sim.ended, None);
    assert_eq!((sim.state.q[0], sim.state.v[0]), (0.0, 0.0));
}

/// With `toe_contact` a toe may land first, then the heel: states 5 to 12 of Table 2 change to 13 to 20.
/// Without it the toe passes through the ice.
#[test]
fn a_free_toe_may_land_first() {
    let land = |toe_contact: bool| {
        let mut scene = Scene::default();
        scene.contact.toe_contact = toe_contact;
        scene.contact.point_contact_holds = true;
        // Toe down, 5 mm above the ice.
        for (joint, q) in [("q5", 0.3), ("q6", -0.6), ("q7", 0.13)] {
            scene.start.q.insert(joint.into(), q);
        }
        let mut sim = simulation(&scene);
        let mut deepest: f64 = 0.0;
        let mut numbers = vec![sim.state.mode.number()];
        while sim.state.mode.free.touch != SoleContact::Flat {
            let next = sim.state.t + 1e-3;
            sim.advance(next);
            numbers.extend(sim.take_events().iter().map(|event| event.to.number()));
            deepest = deepest.min(sim.sole_points.gaps[1][1]);
        }
        (numbers, deepest)
    };
    let (with, toe) = land(true);
    assert!(
        with.contains(&9) && with.iter().any(|&state| state >= 13),
        "{with:?}"
    );
    // Measured -1e-11 m.
    assert!(toe > -1e-9, "{toe}");
    let (_, toe) = land(false);
    // Measured 0.1 m.
    assert!(toe < -1e-3, "{toe}");
}

/// A robot that slides on one flat foot with push-only contact.
fn gliding() -> Scene {
    let mut scene = Scene::default().with("push_only").expect("ice that pushes");
    for (joint, q) in [
        ("q2", 0.1),
        ("q3", -0.2),
        ("q5", 0.5),
        ("q6", -0.9),
        ("q7", 0.4),
    ] {
        scene.start.q.insert(joint.into(), q);
    }
    scene.start.v.insert("y0".into(), 1.0);
    scene
}

/// An ankle torque that lifts one end of the sole and at the same instant the other. The foot used to lose
/// its first end and was sent into the air.
#[test]
fn a_lifted_sole_end_may_land_again() {
    let mut sim = simulation(&gliding());
    let mut ankle = [0.0; 16];
    for torque in [300.0, -300.0, 300.0, -300.0] {
        ankle[0] = torque;
        sim.hold(&ankle);
        let [heel, toe] = sim.eval.loads(&sim.model, sim.state.mode)[0];
        assert_eq!(sim.ended, None);
        assert!(heel + toe > sim.model.weight(), "{torque}: {heel} {toe}");
        assert_eq!(heel > 0.0, torque < 0.0);
    }
}

/// If both feet stick, the foot whose force reaches its cone slips. The other one used to slip instead, and
/// the first stayed at its limit, repeatedly.
#[test]
fn the_foot_at_its_friction_limit_slips() {
    let slips = |push_only: bool| {
        let mut scene = Scene::default();
        if push_only {
            scene = scene.with("push_only").expect("ice that pushes");
        }
        // Knees bent by 0.2 rad, both soles flat.
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
        let mut seen = 0;
        for joint in 0..6 {
            for torque in [-150.0, -60.0, 60.0, 150.0] {
                let mut sim = simulation(&scene);
                let mut held = [0.0; 16];
                for part in 1..=50 {
                    held[joint] = torque * f64::from(part) / 50.0;
                    sim.hold(&held);
                    sim.advance(1e-3 * f64::from(part));
                }
                // A guard may trigger within rounding before the limit; the mode then stays, and its event is logged.
                let changes = sim.take_events().into_iter().filter(|e| e.from != e.to);
                for event in changes {
                    let foot = match event.what {
                        "supporting foot slips forward" | "supporting foot slips backward" => {
                            event.to.support
                        }
                        "free foot slips forward" | "free foot slips backward" => event.to.free,
                        _ => continue,
                    };
                    if sim.state.support_leg == event.leg {
                        assert!(foot.slides() || foot.touch == SoleContact::Air, "{event:?}");
                        seen += 1;
                    }
                }
            }
        }
        seen
    };
    // Measured: 20 and 22 slips.
    let (a, b) = (slips(false), slips(true));
    println!("{a} {b}");
    assert!(a > 10 && b > 10);
}

/// Torques may press a sliding foot with any force. It used to be stopped as if friction had wedged it.
#[test]
fn a_pressed_foot_keeps_sliding() {
    let mut scene = gliding().with("lifting").expect("a controller");
    let lifting = scene.control.lifting.as_mut().expect("just added");
    lifting.K_p = [0.0, 0.0, 1e6];
    scene.ice.friction = Friction::Coulomb {
        mu: 0.01,
        capture_speed: 0.01,
    };
    let mut sim = simulation(&scene);
    assert_eq!((sim.ended, sim.state.mode.number()), (None, 3));
    let [heel, toe] = sim.eval.loads(&sim.model, sim.state.mode)[0];
    assert!(heel + toe > 100.0 * sim.model.weight(), "{heel} {toe}");
    assert_eq!(sim.state.v[0], 1.0);
    sim.advance(1e-5);
    assert!(
        sim.ended.is_none() && sim.state.v[0] > 0.5,
        "{}",
        sim.state.v[0]
    );
}
