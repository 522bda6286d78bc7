//! A scene: everything that a simulation needs, and nothing that it does not call for.
//!
//! A table that is absent is an effect that is off: no `[control.lifting]`, no lifting. The ranges
//! beside the fields are those of `ranges`; choices that contradict each other are listed in `rules`,
//! and all effects in `effects`.

pub mod body;
pub mod effects;
mod numbers;
pub mod ranges;
mod read;
mod rules;

use crate::{integrate::Method, scene::body::Body};
use serde::{Deserialize, Serialize};
use std::collections::BTreeMap;

/// Names of all coordinates, in the order of `q` and `v` (Eq. 9, with z0 for a robot that may leave
/// the ice).
pub const COORDINATES: [&str; 19] = [
    "y0", "z0", "q1", "q2", "q3", "q4", "q5", "q6", "q7", "q8", "q9", "q10", "q11", "q12", "q13",
    "q14", "q15", "q16", "q17",
];

/// See the module's documentation.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Scene {
    pub name: String,
    /// One line for people.
    pub description: String,
    /// Where the free numbers come from.
    pub provenance: String,
    pub accuracy: Accuracy,
    /// Book the energy that torques, damping, friction and impacts bring and take.
    pub energy_balance: bool,
    /// Joints of q8 .. q17 that are held at zero; their links merge into the parent.
    pub locked: Vec<String>,
    pub body: Body,
    pub ice: Ice,
    pub contact: Contact,
    pub control: Control,
    pub stabilizers: Stabilizers,
    pub fall: Option<Fall>,
    pub start: Start,
    /// Numbers that the environment draws anew, evenly from [lowest, highest], for every episode; named as in
    /// `parameters`. A simulation has those of the tables above.
    pub randomise: BTreeMap<String, [f64; 2]>,
}

/// How exactly the motion is integrated.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[serde(
    untagged,
    expecting = "must be fast, balanced, reference, a tolerance, or a table: method dopri5 or rosenbrock with a tolerance or a step, rk4 or moreau with a step"
)]
pub enum Accuracy {
    Named(AccuracyName),
    /// Relative tolerance of the error-controlled method, 1e-13 to 1e-2.
    Tolerance(f64),
    /// An integrator of our choice.
    Method(Method),
    TimeStepping(TimeStepping),
}

/// Steps of two fixed lengths in which contacts act by impulses, for training.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[serde(tag = "method", rename_all = "snake_case", deny_unknown_fields)]
pub enum TimeStepping {
    /// After Moreau (1988); `step` in [s] is the longer of its two, the other is half of it.
    Moreau { step: f64 },
}

/// What an accuracy comes to.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Way {
    /// Smooth motions and located events.
    Events(Method),
    TimeSteps {
        step: f64,
    },
}

/// The accuracies that have a name.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum AccuracyName {
    Fast,
    Balanced,
    Reference,
}

impl Accuracy {
    /// What it stands for.
    pub fn way(self) -> Way {
        let tolerance = match self {
            Self::Named(AccuracyName::Fast) => return Way::TimeSteps { step: FAST },
            Self::TimeStepping(TimeStepping::Moreau { step }) => return Way::TimeSteps { step },
            Self::Method(method) => return Way::Events(method),
            Self::Named(AccuracyName::Balanced) => BALANCED,
            Self::Named(AccuracyName::Reference) => REFERENCE,
            Self::Tolerance(tolerance) => tolerance,
        };
        Way::Events(Method::dopri5(tolerance))
    }
}

/// Step of `fast` [s], relative tolerances of `balanced` and `reference`; `docs/accuracy.md` says why.
const FAST: f64 = 0.005;
const BALANCED: f64 = 1e-6;
const REFERENCE: f64 = 1e-11;

/// The ice and the field above it.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Ice {
    /// Downward acceleration [m/s2], 0 to 100.
    pub gravity: f64,
    pub friction: Friction,
}

/// What resists a foot that slides on the ice.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[serde(tag = "kind", rename_all = "snake_case", deny_unknown_fields)]
pub enum Friction {
    /// Two-way only: feet on the ice never slip.
    Sticking {},
    /// Dry friction that depends on the direction, section 4.1.
    Directional {
        /// Coefficient against forward sliding, 0 to 10.
        mu_forward: f64,
        /// Coefficient against backward sliding, 0 to 10.
        mu_backward: f64,
        /// A foot slower than this sticks if the force allows it, section 2.2 [m/s], 0 to 1.
        capture_speed: f64,
    },
    /// Dry friction of one coefficient.
    Coulomb {
        /// 0 to 10.
        mu: f64,
        /// See `Directional` [m/s], 0 to 1.
        capture_speed: f64,
    },
    /// Two-way only: a force against the supporting foot's velocity, as Eq. 9 has it in its matrix D; the
    /// free foot slides freely.
    Viscous {
        /// [N s/m], 0 to 1000.
        coefficient: f64,
    },
    /// Feet slide freely.
    None {},
}

impl Friction {
    /// Section 4.1.
    pub const PAPER: Self = Self::Directional {
        mu_forward: 0.2,
        mu_backward: 0.9,
        capture_speed: 0.01,
    };
}

/// What the ice does to a foot.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Contact {
    pub law: ContactLaw,
    /// The supporting foot may rotate about its toe or heel: q1. Push-only ice needs it.
    pub foot_rotation: bool,
    /// The free foot touches the ice, otherwise it passes through.
    pub free_foot: bool,
    /// Two-way only: the free toe may touch alone, which Table 2 does not know. On push-only ice every
    /// end of a sole touches.
    pub toe_contact: bool,
    /// Ends of a sole land. Otherwise a contact that has opened stays open.
    pub impacts: bool,
    /// Two-way only: friction of the free foot while its normal force pulls.
    pub pulled_friction: PulledFriction,
    /// Two-way only: the free heel in point contact is held even when its normal force pulls.
    pub point_contact_holds: bool,
    /// Two-way only: viscous couple on the foot that rotates about its edge, d_1 of Eq. 9 [N m s/rad], 0 to 1000.
    pub edge_damping: f64,
}

/// See `Contact::law`.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum ContactLaw {
    /// The paper's constraints hold in both directions; Table 2's transitions.
    TwoWay,
    /// Normal forces only push; any point of a sole may touch, either foot may leave the ice.
    PushOnly,
}

/// See `Contact::pulled_friction`.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum PulledFriction {
    /// Eq. 13 read to the letter: -mu N with a negative N becomes a thrust.
    Literal,
    /// No friction from a negative normal force.
    None,
}

/// The baseline controller and its clocks.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Control {
    /// The switched terms of Eq. 21 are sampled this often [s], 1e-5 to 0.01.
    pub sample_period: f64,
    /// A residual torque is held this long [s], 1e-4 to 1.
    pub action_period: f64,
    pub lifting: Option<Lifting>,
    pub feedforward: Option<Feedforward>,
    pub arm_swing: Option<ArmSwing>,
}

/// Visual lifting, Eqs. 14 and 15.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Lifting {
    /// Gain on the head's x, y, z [N/m], 0 to 1e9.
    pub K_p: [f64; 3],
    /// The head's target ahead of the supporting ankle [m], -5 to 5.
    pub ahead: f64,
    /// The head's target above the ice [m], -5 to 5.
    pub height: f64,
}

/// Feedforward torques, Eqs. 16 to 21.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct Feedforward {
    /// Factor on all torques; 1 is the paper, -10 to 10.
    pub scale: f64,
    /// Factor on tau7 besides; 1 is the paper, -10 to 10.
    pub tau7_scale: f64,
}

impl Default for Feedforward {
    fn default() -> Self {
        Self {
            scale: 1.0,
            tau7_scale: 1.0,
        }
    }
}

/// tau8, Eq. 22.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct ArmSwing {
    /// Peak torque [N m], -1000 to 1000.
    pub amplitude: f64,
}

impl Default for ArmSwing {
    fn default() -> Self {
        Self { amplitude: 30.0 }
    }
}

/// Terms that the paper does not have. All are off unless a scene names them.
#[derive(Debug, Clone, Default, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Stabilizers {
    /// Force on the head against its velocity relative to the supporting ankle, through J_h^T.
    pub head_damping: Option<HeadDamping>,
    /// Torque on the supporting hip towards a pitch of the waist.
    pub hip_pd: Option<ProportionalDerivative>,
    /// Torque on the free knee towards an angle, states 1 to 4.
    pub free_knee_pd: Option<ProportionalDerivative>,
    /// Torque on a knee that passes straight, growing from zero: K q (1 + c q'), q > 0.
    pub knee_stop: Option<KneeStop>,
}

/// See `Stabilizers::head_damping`.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct HeadDamping {
    /// [N s/m], 0 to 1e6.
    pub y: f64,
    /// [N s/m], 0 to 1e6.
    pub z: f64,
}

/// gain (reference - angle) - damping rate.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct ProportionalDerivative {
    /// [N m/rad], 0 to 1e6.
    pub gain: f64,
    /// [rad], -4 to 4.
    pub reference: f64,
    /// [N m s/rad], 0 to 1e6.
    pub damping: f64,
}

impl ProportionalDerivative {
    /// Towards zero.
    pub fn new(gain: f64, damping: f64) -> Self {
        Self {
            gain,
            reference: 0.0,
            damping,
        }
    }
}

/// See `Stabilizers::knee_stop`; Hunt and Crossley (1975), eq. 12 with exponent 1.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct KneeStop {
    /// K [N m/rad], 0 to 1e6.
    pub stiffness: f64,
    /// c [s/rad], 0 to 10.
    pub damping: f64,
}

/// When the robot counts as fallen: the head too low, or a knee or an ankle below the ice.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Fall {
    /// Lowest admissible height of the top of the head [m], -10 to 3.
    pub head_height: f64,
}

/// The state at t = 0. Coordinates that are not named are zero.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Start {
    pub support_leg: Leg,
    pub q: BTreeMap<String, f64>,
    pub v: BTreeMap<String, f64>,
}

/// Which of the robot's legs.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Leg {
    #[default]
    Right,
    Left,
}

impl Leg {
    pub fn other(self) -> Self {
        match self {
            Self::Right => Self::Left,
            Self::Left => Self::Right,
        }
    }

    pub fn name(self) -> &'static str {
        match self {
            Self::Right => "right",
            Self::Left => "left",
        }
    }

    /// +1 on the right (positive x), -1 on the left.
    pub fn sign(self) -> f64 {
        match self {
            Self::Right => 1.0,
            Self::Left => -1.0,
        }
    }
}

impl Default for Scene {
    /// The body of Table 1 standing on the paper's ice without a controller.
    fn default() -> Self {
        Self {
            name: "standing".into(),
            description: String::new(),
            provenance: String::new(),
            accuracy: Accuracy::Named(AccuracyName::Balanced),
            energy_balance: true,
            locked: Vec::new(),
            body: Body::default(),
            ice: Ice {
                gravity: 9.81,
                friction: Friction::PAPER,
            },
            contact: Contact {
                law: ContactLaw::TwoWay,
                foot_rotation: true,
                free_foot: true,
                toe_contact: false,
                impacts: true,
                pulled_friction: PulledFriction::Literal,
                point_contact_holds: false,
                edge_damping: 0.0,
            },
            control: Control {
                sample_period: 1e-3,
                action_period: 0.01,
                lifting: None,
                feedforward: None,
                arm_swing: None,
            },
            stabilizers: Stabilizers::default(),
            fall: None,
            start: Start {
                support_leg: Leg::Right,
                q: BTreeMap::new(),
                v: BTreeMap::new(),
            },
            randomise: BTreeMap::new(),
        }
    }
}
