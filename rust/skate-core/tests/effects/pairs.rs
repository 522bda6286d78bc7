//! For every effect: a scene without it, and a full scene in which it is inactive.

use skate_core::scene::*;

/// How to leave an effect out, and how to make it inactive.
pub struct Pair {
    pub name: &'static str,
    pub absent: fn(&mut Scene),
    pub inactive: fn(&mut Scene),
    /// Joints that are locked; in the full scene a torque holds them.
    pub joints: &'static [&'static str],
}

const fn joints(name: &'static str, joints: &'static [&'static str]) -> Pair {
    Pair {
        name,
        absent: |_| {},
        inactive: |_| {},
        joints,
    }
}

const fn pair(name: &'static str, absent: fn(&mut Scene), inactive: fn(&mut Scene)) -> Pair {
    Pair {
        name,
        absent,
        inactive,
        joints: &[],
    }
}

pub fn dry(forward: f64, backward: f64) -> Friction {
    Friction::Directional {
        mu_forward: forward,
        mu_backward: backward,
        capture_speed: 0.01,
    }
}

pub const PAIRS: [Pair; 26] = [
    joints("arms", &["q11", "q12", "q13", "q14", "q15", "q16"]),
    joints("head_joint", &["q17"]),
    joints("trunk_yaw", &["q8"]),
    joints("trunk_pitch", &["q9"]),
    joints("trunk_roll", &["q10"]),
    pair(
        "joint_damping",
        |scene| scene.body.joint_damping = false,
        |scene| {
            scene.body.joint_damping = true;
            let b = &mut scene.body;
            let trunk = [
                &mut b.head,
                &mut b.upper_body,
                &mut b.middle_body,
                &mut b.lower_body,
            ];
            let arms = [&mut b.upper_arm, &mut b.lower_arm, &mut b.hand];
            let legs = [&mut b.upper_leg, &mut b.lower_leg];
            let links = trunk.into_iter().chain(arms).chain(legs);
            links.for_each(|link| link.damping = 0.0);
            b.foot.damping = 0.0;
        },
    ),
    // Gravity too small to change any result.
    pair(
        "gravity",
        |scene| scene.ice.gravity = 0.0,
        |scene| scene.ice.gravity = 1e-300,
    ),
    pair(
        "slipping",
        |scene| {
            scene.ice.friction = Friction::Sticking {};
            scene.contact.point_contact_holds = scene.contact.free_foot;
            scene.start.v.remove("y0");
        },
        |scene| {
            scene.ice.friction = dry(10.0, 10.0);
            scene.contact.point_contact_holds = scene.contact.free_foot;
            scene.start.v.remove("y0");
        },
    ),
    pair(
        "directional_friction",
        |scene| {
            scene.ice.friction = Friction::Coulomb {
                mu: 0.3,
                capture_speed: 0.01,
            };
        },
        |scene| scene.ice.friction = dry(0.3, 0.3),
    ),
    pair(
        "coulomb_friction",
        |scene| scene.ice.friction = Friction::None {},
        |scene| {
            scene.ice.friction = Friction::Coulomb {
                mu: 0.0,
                capture_speed: 0.01,
            };
        },
    ),
    pair(
        "viscous_friction",
        |scene| scene.ice.friction = Friction::None {},
        |scene| {
            scene.ice.friction = Friction::Viscous {
                coefficient: 1e-300,
            }
        },
    ),
    pair(
        "foot_rotation",
        |scene| {
            scene.contact.foot_rotation = false;
            scene.contact.edge_damping = 0.0;
        },
        |scene| scene.contact.foot_rotation = true,
    ),
    pair(
        "edge_damping",
        |scene| scene.contact.edge_damping = 0.0,
        |scene| scene.contact.edge_damping = 1e-300,
    ),
    pair(
        "free_foot_contact",
        |scene| {
            scene.contact.free_foot = false;
            scene.contact.toe_contact = false;
            scene.contact.point_contact_holds = false;
        },
        |scene| scene.contact.free_foot = true,
    ),
    pair(
        "toe_contact",
        |scene| scene.contact.toe_contact = false,
        |scene| scene.contact.toe_contact = true,
    ),
    pair(
        "impacts",
        |scene| {
            scene.contact.impacts = false;
            scene.contact.toe_contact = false;
        },
        |scene| scene.contact.impacts = true,
    ),
    pair(
        "push_only",
        |scene| scene.contact.law = ContactLaw::TwoWay,
        |scene| {
            scene.contact.law = ContactLaw::PushOnly;
            scene.contact.toe_contact = false;
            scene.contact.edge_damping = 0.0;
        },
    ),
    pair(
        "lifting",
        |scene| scene.control.lifting = None,
        |scene| {
            scene.control.lifting = Some(Lifting {
                K_p: [0.0; 3],
                ahead: 0.1,
                height: 2.0,
            });
        },
    ),
    pair(
        "feedforward",
        |scene| scene.control.feedforward = None,
        |scene| {
            scene.control.feedforward = Some(Feedforward {
                scale: 0.0,
                t2: PushOffStart::Rotation,
                tau1_scale: 1.0,
                tau7_scale: 1.0,
            });
        },
    ),
    pair(
        "arm_swing",
        |scene| scene.control.arm_swing = None,
        |scene| scene.control.arm_swing = Some(ArmSwing { amplitude: 0.0 }),
    ),
    pair(
        "head_damping",
        |scene| scene.stabilizers.head_damping = None,
        |scene| scene.stabilizers.head_damping = Some(HeadDamping { y: 0.0, z: 0.0 }),
    ),
    pair(
        "hip_pd",
        |scene| scene.stabilizers.hip_pd = None,
        |scene| scene.stabilizers.hip_pd = Some(ProportionalDerivative::new(0.0, 0.0)),
    ),
    pair(
        "free_knee_pd",
        |scene| scene.stabilizers.free_knee_pd = None,
        |scene| scene.stabilizers.free_knee_pd = Some(ProportionalDerivative::new(0.0, 0.0)),
    ),
    pair(
        "knee_stop",
        |scene| scene.stabilizers.knee_stop = None,
        |scene| {
            scene.stabilizers.knee_stop = Some(KneeStop {
                stiffness: 0.0,
                damping: 1.0,
            });
        },
    ),
    pair(
        "fall_detection",
        |scene| scene.fall = None,
        |scene| scene.fall = Some(Fall { head_height: -10.0 }),
    ),
    pair(
        "energy_balance",
        |scene| scene.energy_balance = false,
        |scene| scene.energy_balance = true,
    ),
];
