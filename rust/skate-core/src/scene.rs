//! A scene: everything that a simulation needs, and nothing that it does not call for.
//!
//! A table that is absent is an effect that is off: no `[control.lifting]`, no lifting. A scene file
//! holds only what differs from the defaults; it is laid over them before it is read, so an unknown
//! name, a missing value and a value out of range are all refused with the field's dotted name.

use crate::{error::Invalid, params::Body};
use serde::{Deserialize, Serialize, de::DeserializeOwned};
use serde_json::Value;
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
    /// Joints of q8 .. q17 that are held at zero; their links merge into the parent.
    pub locked: Vec<String>,
    pub body: Body,
    pub ice: Ice,
    pub contact: Contact,
    pub control: Control,
    pub helpers: Helpers,
    pub fall: Fall,
    pub start: Start,
}

/// How exactly the motion is integrated.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[serde(untagged)]
pub enum Accuracy {
    Named(AccuracyName),
    /// Relative tolerance of the error-controlled method, 1e-13 to 1e-2.
    Tolerance(f64),
}

/// The tolerances that have a name.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum AccuracyName {
    Balanced,
    Reference,
}

impl Accuracy {
    /// Relative tolerance per step.
    pub fn tolerance(self) -> f64 {
        match self {
            Self::Named(AccuracyName::Balanced) => 1e-6,
            Self::Named(AccuracyName::Reference) => 1e-11,
            Self::Tolerance(tolerance) => tolerance,
        }
    }
}

/// The ice and the field above it.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Ice {
    /// Downward acceleration [m/s2], 0 to 100.
    pub gravity: f64,
    /// Coefficient against forward sliding, section 4.1, 0 to 10.
    pub mu_forward: f64,
    /// Coefficient against backward sliding, section 4.1, 0 to 10.
    pub mu_backward: f64,
    /// A foot slower than this sticks if the force allows it, section 2.2 [m/s], 0 to 1.
    pub capture_speed: f64,
}

/// What the ice does to a foot.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Contact {
    pub law: ContactLaw,
    /// Two-way only: friction of the free foot while its normal force pulls.
    pub pulled_friction: PulledFriction,
    /// Two-way only: the free heel in point contact is held even when its normal force pulls.
    pub point_contact_holds: bool,
    /// Viscous couple on a foot that rotates about its edge, d_1 of Eq. 9 [N m s/rad], 0 to 1000.
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
    /// Factor on tau7; 1 is the paper, -10 to 10.
    pub tau7_scale: f64,
}

impl Default for Feedforward {
    fn default() -> Self {
        Self { tau7_scale: 1.0 }
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
pub struct Helpers {
    /// Force on the head against its velocity relative to the supporting ankle, through J_h^T.
    pub head_damping: Option<HeadDamping>,
    /// Torque on the supporting hip towards a pitch of the waist.
    pub hip_pd: Option<ProportionalDerivative>,
    /// Torque on the free knee towards an angle, states 1 to 4.
    pub free_knee_pd: Option<ProportionalDerivative>,
    /// Torque on a knee that passes straight, growing from zero: K q (1 + c q'), q > 0.
    pub knee_stop: Option<KneeStop>,
}

/// See `Helpers::head_damping`.
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

/// See `Helpers::knee_stop`; Hunt and Crossley (1975), eq. 12 with exponent 1.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct KneeStop {
    /// K [N m/rad], 0 to 1e6.
    pub stiffness: f64,
    /// c [s/rad], 0 to 10.
    pub damping: f64,
}

/// When the robot counts as fallen.
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
            locked: Vec::new(),
            body: Body::default(),
            ice: Ice {
                gravity: 9.81,
                mu_forward: 0.2,
                mu_backward: 0.9,
                capture_speed: 0.01,
            },
            contact: Contact {
                law: ContactLaw::TwoWay,
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
            helpers: Helpers::default(),
            fall: Fall { head_height: 1.0 },
            start: Start {
                support_leg: Leg::Right,
                q: BTreeMap::new(),
                v: BTreeMap::new(),
            },
        }
    }
}

impl Scene {
    /// Read a scene file.
    pub fn from_toml(text: &str) -> Result<Self, Invalid> {
        let table: Value = toml::from_str(text).map_err(|e| Invalid(format!("not TOML: {e}")))?;
        Self::over_defaults(table)
    }

    /// Read a scene as JSON, in full or in part.
    pub fn from_json(text: &str) -> Result<Self, Invalid> {
        let table = serde_json::from_str(text).map_err(|e| Invalid(format!("not JSON: {e}")))?;
        Self::over_defaults(table)
    }

    /// Every field, as TOML.
    pub fn to_toml(&self) -> String {
        toml::to_string(self).expect("a scene is made of tables, strings and numbers")
    }

    /// Every field, as JSON.
    pub fn to_json(&self) -> String {
        serde_json::to_string(self).expect("a scene is made of tables, strings and numbers")
    }

    fn over_defaults(given: Value) -> Result<Self, Invalid> {
        let mut table = serde_json::to_value(Self::default()).expect("see to_json");
        lay_over(&mut table, given);
        let scene: Self = parse(table)?;
        scene.validate()?;
        Ok(scene)
    }

    fn validate(&self) -> Result<(), Invalid> {
        self.body.validate()?;
        Invalid::range(
            "accuracy",
            self.accuracy.tolerance(),
            1e-13,
            1e-2,
            "(relative)",
        )?;
        Invalid::range("ice.gravity", self.ice.gravity, 0.0, 100.0, "m/s2")?;
        Invalid::range("ice.mu_forward", self.ice.mu_forward, 0.0, 10.0, "")?;
        Invalid::range("ice.mu_backward", self.ice.mu_backward, 0.0, 10.0, "")?;
        Invalid::range("ice.capture_speed", self.ice.capture_speed, 0.0, 1.0, "m/s")?;
        let edge = self.contact.edge_damping;
        Invalid::range("contact.edge_damping", edge, 0.0, 1e3, "N m s/rad")?;
        let control = &self.control;
        Invalid::range(
            "control.sample_period",
            control.sample_period,
            1e-5,
            0.01,
            "s",
        )?;
        Invalid::range(
            "control.action_period",
            control.action_period,
            1e-4,
            1.0,
            "s",
        )?;
        if let Some(lifting) = &control.lifting {
            for gain in lifting.K_p {
                Invalid::range("control.lifting.K_p", gain, 0.0, 1e9, "N/m")?;
            }
            Invalid::range("control.lifting.ahead", lifting.ahead, -5.0, 5.0, "m")?;
            Invalid::range("control.lifting.height", lifting.height, -5.0, 5.0, "m")?;
        }
        if let Some(feedforward) = &control.feedforward {
            let scale = feedforward.tau7_scale;
            Invalid::range("control.feedforward.tau7_scale", scale, -10.0, 10.0, "")?;
        }
        if let Some(swing) = &control.arm_swing {
            Invalid::range(
                "control.arm_swing.amplitude",
                swing.amplitude,
                -1e3,
                1e3,
                "N m",
            )?;
        }
        self.helpers.validate()?;
        Invalid::range("fall.head_height", self.fall.head_height, -10.0, 3.0, "m")?;
        self.validate_start()
    }

    fn validate_start(&self) -> Result<(), Invalid> {
        for joint in &self.locked {
            if !COORDINATES[9..].contains(&joint.as_str()) {
                return Err(Invalid(format!(
                    "locked: \"{joint}\": only q8 to q17 can be locked"
                )));
            }
        }
        for (table, values) in [("start.q", &self.start.q), ("start.v", &self.start.v)] {
            for (name, &x) in values {
                if !COORDINATES.contains(&name.as_str()) {
                    let known = COORDINATES.join(", ");
                    return Err(Invalid(format!(
                        "{table}.{name}: unknown; known are {known}"
                    )));
                }
                Invalid::range(
                    &format!("{table}.{name}"),
                    x,
                    -1e6,
                    1e6,
                    "rad, m or per second",
                )?;
                if x != 0.0 && self.locked.contains(name) {
                    return Err(Invalid(format!(
                        "{table}.{name} = {x}: {name} is locked at zero"
                    )));
                }
            }
        }
        Ok(())
    }
}

impl Helpers {
    fn validate(&self) -> Result<(), Invalid> {
        if let Some(damping) = &self.head_damping {
            Invalid::range("helpers.head_damping.y", damping.y, 0.0, 1e6, "N s/m")?;
            Invalid::range("helpers.head_damping.z", damping.z, 0.0, 1e6, "N s/m")?;
        }
        for (name, pd) in [
            ("hip_pd", &self.hip_pd),
            ("free_knee_pd", &self.free_knee_pd),
        ] {
            let Some(pd) = pd else { continue };
            Invalid::range(
                &format!("helpers.{name}.gain"),
                pd.gain,
                0.0,
                1e6,
                "N m/rad",
            )?;
            Invalid::range(
                &format!("helpers.{name}.reference"),
                pd.reference,
                -4.0,
                4.0,
                "rad",
            )?;
            Invalid::range(
                &format!("helpers.{name}.damping"),
                pd.damping,
                0.0,
                1e6,
                "N m s/rad",
            )?;
        }
        if let Some(stop) = &self.knee_stop {
            Invalid::range(
                "helpers.knee_stop.stiffness",
                stop.stiffness,
                0.0,
                1e6,
                "N m/rad",
            )?;
            Invalid::range(
                "helpers.knee_stop.damping",
                stop.damping,
                0.0,
                10.0,
                "s/rad",
            )?;
        }
        Ok(())
    }
}

/// Replace, in `base`, whatever `given` names; tables are merged, everything else is taken over.
fn lay_over(base: &mut Value, given: Value) {
    match (base, given) {
        (Value::Object(base), Value::Object(given)) => {
            for (key, value) in given {
                match base.get_mut(&key) {
                    Some(old) => lay_over(old, value),
                    None => {
                        base.insert(key, value);
                    }
                }
            }
        }
        (base, given) => *base = given,
    }
}

fn parse<T: DeserializeOwned>(table: Value) -> Result<T, Invalid> {
    serde_path_to_error::deserialize(table)
        .map_err(|e| Invalid(format!("{}: {}", e.path(), e.inner())))
}
