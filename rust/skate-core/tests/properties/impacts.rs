//! Impacts of both feet at random velocities.

use crate::strategies::{config, friction, vector};
use proptest::prelude::*;
use skate_core::{
    dynamics::bias_forces,
    model::{
        Model,
        contact_mode::SoleContact,
        layout::{FREE_FOOT, NV},
    },
    scene::{ContactLaw, Friction, Leg, PulledFriction, Scene},
    sim::Simulation,
};

/// Posture on the ice: the supporting foot flat or on its edge, the free foot flat beside or in front of
/// it, or in the air.
#[derive(Debug, Clone, Copy)]
enum StepContacts {
    /// Both feet flat; angles of the supporting shank and thigh and of the free thigh [rad].
    Flat([f64; 3]),
    /// Supporting foot on its toe or heel at this angle, the other foot in the air.
    Edge(f64),
    One,
}

fn feet() -> impl Strategy<Value = StepContacts> {
    prop_oneof![
        (0.05..0.5, -0.5..-0.05, -0.5..0.5).prop_map(|(a, b, c)| StepContacts::Flat([a, b, c])),
        (-0.6..0.6).prop_map(StepContacts::Edge),
        Just(StepContacts::One),
    ]
}

/// Coordinates of the posture with the trunk bent by `lean`; None if the free leg is too short.
fn posture(model: &Model, feet: StepContacts, lean: &[f64; NV]) -> Option<[f64; NV]> {
    let mut q = [0.0; NV];
    q[9..model.n].copy_from_slice(&lean[9..model.n]);
    let mut set = |values: [f64; 6]| q[3..9].copy_from_slice(&values);
    match feet {
        StepContacts::Flat([shank, thigh, free_thigh]) => {
            let body = &model.scene.body;
            let (lower, upper) = (body.lower_leg.length, body.upper_leg.length);
            let height = lower * shank.cos() + upper * thigh.cos();
            let free_shank = (height - upper * free_thigh.cos()) / lower;
            if free_shank.abs() >= 1.0 {
                return None;
            }
            // Absolute angles of shank, thigh and waist (upright), and of the free leg.
            let free_shank = free_shank.acos();
            set([
                shank,
                thigh - shank,
                -thigh,
                free_thigh,
                free_shank - free_thigh,
                -free_shank,
            ]);
        }
        StepContacts::Edge(angle) => {
            set([0.1 - angle, -0.2, 0.1, 0.5, -0.9, 0.4]);
            q[2] = angle;
            q[1] = model.sole.length() * angle.sin().max(0.0);
        }
        StepContacts::One => set([0.1, -0.2, 0.1, 0.5, -0.9, 0.4]),
    }
    Some(q)
}

proptest! {
    #![proptest_config(config(2_000))]

    /// An impact never adds kinetic energy, and no contact point moves into the ice after it.
    #[test]
    fn an_impact_never_adds_energy(
        feet in feet(), lean in vector(0.3), v in vector(3.0), push_only in any::<bool>(),
        friction in friction(), holds in any::<bool>(), still in any::<bool>(), literal in any::<bool>(),
    ) {
        let mut scene = Scene::default();
        scene.ice.friction = friction;
        scene.contact.point_contact_holds = holds && !push_only;
        scene.contact.law = if push_only { ContactLaw::PushOnly } else { ContactLaw::TwoWay };
        if !push_only && !literal {
            scene.contact.pulled_friction = PulledFriction::None;
        }
        let mut sim = Simulation::new(Model::compile(&scene).expect("a model")).expect("standing");
        let Some(q) = posture(&sim.model, feet, &lean) else { return Ok(()) };
        let mut v = v;
        if still {
            // The supporting foot is at rest, the free foot lands.
            v[..3].fill(0.0);
        }
        let energy = |sim: &Simulation, touch: SoleContact, q: &[f64; NV], v: &[f64; NV]| {
            let mut eval = sim.eval.clone();
            eval.full_kinematics(&sim.model, touch, q, v);
            bias_forces::energy(&sim.model, &eval.kin, v, q[1])
        };
        let (kinetic, potential) = energy(&sim, SoleContact::Toe, &q, &v);
        // No posture starts below the ice; a few have no consistent motion.
        if let Err(why) = sim.reset(&q, &v, Leg::Right) {
            prop_assert!(why.0.contains("no motion"), "{why}");
            return Ok(());
        }
        let state = &sim.state;
        let (after, raised) = energy(&sim, state.mode.support.touch, &state.q, &state.v);
        // Measured at most 5e-15 of it.
        prop_assert!(after - kinetic <= 1e-12 * kinetic, "{kinetic} J become {after}");
        // Measured at most 3e-13 J; an impact does not change positions.
        prop_assert!((raised - potential).abs() < 1e-9, "{potential} J become {raised}");
        prop_assert!(state.energy_balance.impacts + state.energy_balance.capture >= -1e-9 * kinetic);
        if push_only && sim.ended.is_none() {
            let eval = sim.full_kinematics();
            for (gap, body) in sim.sole_points.gaps.into_iter().zip([0, FREE_FOOT]) {
                for (gap, along) in gap.into_iter().zip([sim.model.sole.heel, sim.model.sole.toe]) {
                    let at = eval.kin.sole_point_of(&*sim.model, body, along);
                    let at = nalgebra::Vector3::new(0.0, at.y, at.z);
                    let down = -eval.kin.point_velocity(body, &at).z;
                    // Measured at most 4e-14 m/s.
                    prop_assert!(gap > 1e-9 || down <= 1e-11, "{body} {along}: {down:e} m/s at {gap:e} m");
                }
            }
        }
    }
}

/// A free foot that sticks after a wedge used to keep its previous sticking position, so that the robot was
/// displaced, here by 0.1 m.
#[test]
fn a_free_foot_that_sticks_after_a_wedge_keeps_its_position() {
    let of_the_free = (
        0.7359075422276596,
        [0.05, -0.21797581824211196, 0.0],
        [
            0.0,
            0.0,
            0.0,
            0.461800372410182,
            -2.2748094334222233,
            0.9351300597942124,
            1.8096325507135997,
            1.6735610397186158,
        ],
    );
    let of_the_supporting = (
        1.489164316077048,
        [
            0.14162349693771917,
            -0.33770061993683215,
            -0.17142535817130178,
        ],
        [
            1.952582636062824,
            0.6347695542935686,
            2.9310436557111683,
            -2.1025747298439987,
            -2.776984134343407,
            -0.4213357634744584,
            2.0668643244109863,
            0.0,
        ],
    );
    for (mu_forward, feet, rates) in [of_the_free, of_the_supporting] {
        let mut scene = Scene::default();
        scene.contact.pulled_friction = PulledFriction::None;
        scene.ice.friction = Friction::Directional {
            mu_forward,
            mu_backward: 0.0,
            capture_speed: 0.01,
        };
        let model = Model::compile(&scene).expect("a model");
        let mut sim = Simulation::new(model).expect("standing");
        let q =
            posture(&sim.model, StepContacts::Flat(feet), &[0.0; NV]).expect("long enough legs");
        let mut v = [0.0; NV];
        v[..8].copy_from_slice(&rates);
        sim.reset(&q, &v, Leg::Right).expect("a start");
        assert_eq!(sim.state.q, q);
    }
}
