//! Effects: named parts of the physics and of the controller that a scene may leave out.
//!
//! The compiled `Model` contains no coordinate, row, guard or controller term of an effect that is off.

use crate::{error::Invalid, scene::*};

/// One effect.
#[derive(Debug, Clone, Copy)]
pub struct Effect {
    pub name: &'static str,
    /// One line of text.
    pub description: &'static str,
    is_on: fn(&Scene) -> bool,
    leave_out: fn(&mut Scene),
    add: fn(&mut Scene),
}

/// An effect that is an optional table of the scene with the same name; adding it inserts typical numbers.
macro_rules! optional {
    ($table:ident.$name:ident = $typical:expr, $description:literal) => {
        Effect {
            name: stringify!($name),
            description: $description,
            is_on: |scene| scene.$table.$name.is_some(),
            leave_out: |scene| scene.$table.$name = None,
            add: |scene| scene.$table.$name = Some($typical),
        }
    };
}

const ARMS: [&str; 6] = ["q11", "q12", "q13", "q14", "q15", "q16"];

/// All effects, in the order of the scene's tables.
pub const EFFECTS: [Effect; 26] = [
    Effect {
        name: "arms",
        description: "shoulders, elbows and wrists move: q11 to q16",
        is_on: |scene| ARMS.iter().any(|joint| !scene.is_locked(joint)),
        leave_out: |scene| lock(scene, &ARMS),
        add: |scene| unlock(scene, &ARMS),
    },
    Effect {
        name: "head_joint",
        description: "the head pitches: q17",
        is_on: |scene| !scene.is_locked("q17"),
        leave_out: |scene| lock(scene, &["q17"]),
        add: |scene| unlock(scene, &["q17"]),
    },
    Effect {
        name: "trunk_yaw",
        description: "the trunk yaws: q8, on which tau8 acts",
        is_on: |scene| !scene.is_locked("q8"),
        leave_out: |scene| {
            lock(scene, &["q8"]);
            scene.control.arm_swing = None;
        },
        add: |scene| unlock(scene, &["q8"]),
    },
    Effect {
        name: "trunk_pitch",
        description: "the trunk pitches: q9",
        is_on: |scene| !scene.is_locked("q9"),
        leave_out: |scene| lock(scene, &["q9"]),
        add: |scene| unlock(scene, &["q9"]),
    },
    Effect {
        name: "trunk_roll",
        description: "the trunk rolls: q10",
        is_on: |scene| !scene.is_locked("q10"),
        leave_out: |scene| lock(scene, &["q10"]),
        add: |scene| unlock(scene, &["q10"]),
    },
    Effect {
        name: "joint_damping",
        description: "viscous friction of the joints, Table 1",
        is_on: |scene| scene.body.joint_damping,
        leave_out: |scene| scene.body.joint_damping = false,
        add: |scene| scene.body.joint_damping = true,
    },
    Effect {
        name: "gravity",
        description: "gravity acts",
        is_on: |scene| scene.ice.gravity != 0.0,
        leave_out: |scene| scene.ice.gravity = 0.0,
        add: |scene| scene.ice.gravity = Scene::default().ice.gravity,
    },
    Effect {
        name: "slipping",
        description: "feet slide: y0",
        is_on: |scene| scene.ice.friction != Friction::Sticking {},
        leave_out: |scene| {
            scene.ice.friction = Friction::Sticking {};
            scene.contact.point_contact_holds = scene.contact.free_foot;
            scene.start.v.remove("y0");
        },
        add: |scene| scene.ice.friction = Friction::PAPER,
    },
    Effect {
        name: "directional_friction",
        description: "dry friction, smaller against forward sliding (section 4.1)",
        is_on: |scene| matches!(scene.ice.friction, Friction::Directional { .. }),
        leave_out: |scene| scene.ice.friction = Friction::None {},
        add: |scene| scene.ice.friction = Friction::PAPER,
    },
    Effect {
        name: "coulomb_friction",
        description: "dry friction with one coefficient, instead of directional friction",
        is_on: |scene| matches!(scene.ice.friction, Friction::Coulomb { .. }),
        leave_out: |scene| scene.ice.friction = Friction::None {},
        add: |scene| {
            scene.ice.friction = Friction::Coulomb {
                mu: 0.2,
                capture_speed: 0.01,
            };
        },
    },
    Effect {
        name: "viscous_friction",
        description: "friction proportional to the speed of the supporting foot (D of Eq. 9), instead of dry friction",
        is_on: |scene| matches!(scene.ice.friction, Friction::Viscous { .. }),
        leave_out: |scene| scene.ice.friction = Friction::None {},
        add: |scene| scene.ice.friction = Friction::Viscous { coefficient: 10.0 },
    },
    Effect {
        name: "foot_rotation",
        description: "the supporting foot rotates about its toe or heel: q1",
        is_on: |scene| scene.contact.foot_rotation,
        leave_out: |scene| {
            scene.contact.foot_rotation = false;
            scene.contact.edge_damping = 0.0;
        },
        add: |scene| scene.contact.foot_rotation = true,
    },
    Effect {
        name: "edge_damping",
        description: "two-way contact: viscous torque on the supporting foot that rotates about its edge",
        is_on: |scene| scene.contact.edge_damping != 0.0,
        leave_out: |scene| scene.contact.edge_damping = 0.0,
        add: |scene| scene.contact.edge_damping = 10.0,
    },
    Effect {
        name: "free_foot_contact",
        description: "the free foot touches the ice: states 5 to 20",
        is_on: |scene| scene.contact.free_foot,
        leave_out: |scene| {
            scene.contact.free_foot = false;
            scene.contact.toe_contact = false;
            scene.contact.point_contact_holds = false;
        },
        add: |scene| scene.contact.free_foot = true,
    },
    Effect {
        name: "toe_contact",
        description: "two-way contact: the free toe may touch alone",
        is_on: |scene| scene.contact.toe_contact,
        leave_out: |scene| scene.contact.toe_contact = false,
        add: |scene| scene.contact.toe_contact = true,
    },
    Effect {
        name: "impacts",
        description: "ends of a sole land; without it, a contact that has opened stays open",
        is_on: |scene| scene.contact.impacts,
        leave_out: |scene| {
            scene.contact.impacts = false;
            scene.contact.toe_contact = false;
        },
        add: |scene| scene.contact.impacts = true,
    },
    Effect {
        name: "push_only",
        description: "the ice only pushes, either end of a sole may land and lift off",
        is_on: |scene| scene.contact.law == ContactLaw::PushOnly,
        leave_out: |scene| scene.contact.law = ContactLaw::TwoWay,
        add: |scene| {
            let contact = &mut scene.contact;
            contact.law = ContactLaw::PushOnly;
            contact.pulled_friction = PulledFriction::Literal;
            contact.point_contact_holds = false;
            contact.toe_contact = false;
            contact.edge_damping = 0.0;
        },
    },
    optional!(
        control.lifting = Lifting {
            K_p: [300.0, 500.0, 5000.0],
            ahead: 0.5,
            height: 2.0,
        },
        "a force pulls the head towards a point above and ahead (Eqs. 14, 15)"
    ),
    optional!(
        control.feedforward = Feedforward::default(),
        "feedforward torques of the legs (Eqs. 16 to 21)"
    ),
    optional!(
        control.arm_swing = ArmSwing::default(),
        "yaw torque that swings the arms (Eq. 22)"
    ),
    optional!(
        stabilizers.head_damping = HeadDamping { y: 50.0, z: 500.0 },
        "stabilizer: a force against the head's velocity"
    ),
    optional!(
        stabilizers.hip_pd = ProportionalDerivative::new(200.0, 50.0),
        "stabilizer: a torque on the supporting hip towards an upright waist"
    ),
    optional!(
        stabilizers.free_knee_pd = ProportionalDerivative::new(1.0, 1.0),
        "stabilizer: a torque that extends the free knee, states 1 to 4"
    ),
    optional!(
        stabilizers.knee_stop = KneeStop {
            stiffness: 500.0,
            damping: 0.1,
        },
        "stabilizer: a torque against a knee that bends backward"
    ),
    Effect {
        name: "fall_detection",
        description: "the simulation ends when the head is too low, or a knee or an ankle below the ice",
        is_on: |scene| scene.fall.is_some(),
        leave_out: |scene| scene.fall = None,
        add: |scene| scene.fall = Some(Fall { head_height: 1.0 }),
    },
    Effect {
        name: "energy_balance",
        description: "the energy that torques, damping, friction and impacts add and remove is recorded",
        is_on: |scene| scene.energy_balance,
        leave_out: |scene| scene.energy_balance = false,
        add: |scene| scene.energy_balance = true,
    },
];

/// Effects whose names have changed, old and new.
const RENAMED: [(&str, &str); 5] = [
    ("tau8", "arm_swing"),
    ("torso_pitch", "trunk_pitch"),
    ("torso_roll", "trunk_roll"),
    ("torso_yaw", "trunk_yaw"),
    ("visual_lifting", "lifting"),
];

impl Effect {
    /// Does the scene contain it?
    pub fn is_on(&self, scene: &Scene) -> bool {
        (self.is_on)(scene)
    }
}

impl Scene {
    /// A copy without an effect, and without what depends on it.
    ///
    /// # Errors
    /// `Invalid` for an unknown name, and if the rest of the scene needs the effect.
    pub fn without(&self, effect: &str) -> Result<Self, Invalid> {
        self.changed(effect, |effect| effect.leave_out)
    }

    /// A copy with an effect; its numbers have typical values.
    ///
    /// # Errors
    /// As for `without`.
    pub fn with(&self, effect: &str) -> Result<Self, Invalid> {
        self.changed(effect, |effect| effect.add)
    }

    fn changed(&self, name: &str, how: fn(&Effect) -> fn(&mut Self)) -> Result<Self, Invalid> {
        let effect = EFFECTS.iter().find(|effect| effect.name == name);
        let effect = effect.ok_or_else(|| {
            if let Some((_, new)) = RENAMED.iter().find(|(old, _)| *old == name) {
                return Invalid(format!("effect \"{name}\": its name is \"{new}\" now"));
            }
            let known: Vec<_> = EFFECTS.iter().map(|effect| effect.name).collect();
            let known = known.join(", ");
            Invalid(format!("effect \"{name}\": unknown; known are {known}"))
        })?;
        let mut scene = self.clone();
        how(effect)(&mut scene);
        scene.validate()?;
        Ok(scene)
    }
}

/// Lock joints at zero and remove their initial values.
fn lock(scene: &mut Scene, joints: &[&str]) {
    for &joint in joints {
        if !scene.is_locked(joint) {
            scene.locked.push(joint.into());
        }
        scene.start.q.remove(joint);
        scene.start.v.remove(joint);
    }
}

fn unlock(scene: &mut Scene, joints: &[&str]) {
    scene
        .locked
        .retain(|locked| !joints.contains(&locked.as_str()));
}
