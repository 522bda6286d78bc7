//! The paper's controller and its sampling periods.

use crate::scene::declaration::{Numbers, table};
use serde::{Deserialize, Serialize};

table! {
    /// The paper's controller and its sampling periods. An absent table is a term that is off.
    #[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
    #[serde(default)]
    pub struct Control {
        /// Sampling period of the switched terms of Eq. 21.
        pub sample_period: f64 [1e-5, 0.01, "s"] = 1e-3,
        /// How long a residual torque is held.
        pub action_period: f64 [1e-4, 1.0, "s"] = 0.01,
        /// The point psi of the head on which visual lifting and head damping act: its distance from the neck over
        /// the length of the head. 1 is the top of the head, 0.5 its centre.
        pub psi: f64 [0.0, 1.0, "1"] = 1.0,
        pub lifting: Option<Lifting> = None,
        pub feedforward: Option<Feedforward> = None,
        pub arm_swing: Option<ArmSwing> = None,
    }
}

table! {
    /// Visual lifting, Eqs. 14 and 15.
    #[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
    pub struct Lifting {
        /// Gain on the head's x, y, z.
        pub K_p: [f64; 3] [0.0, 1e9, "N/m"],
        /// Distance of the head's target ahead of the supporting ankle.
        pub ahead: f64 [-5.0, 5.0, "m"],
        /// Height of the head's target above the ice.
        pub height: f64 [-5.0, 5.0, "m"],
    }
}

table! {
    /// Feedforward torques, Eqs. 16 to 21.
    #[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
    #[serde(default)]
    pub struct Feedforward {
        /// Event at which t2 of Eqs. 16 and 17 begins.
        pub t2: PushOffStart = PushOffStart::Rotation,
        /// Factor on all torques; 1 as in the paper.
        pub scale: f64 [-10.0, 10.0, "1"] = 1.0,
        /// Additional factor on tau1, the couple on the supporting foot; 1 as in the paper. Push-only ice cannot
        /// exert a couple on a foot that touches it with one end.
        pub tau1_scale: f64 [-10.0, 10.0, "1"] = 1.0,
        /// Additional factor on tau7; 1 as in the paper.
        pub tau7_scale: f64 [-10.0, 10.0, "1"] = 1.0,
    }
}

table! {
    /// tau8, Eq. 22.
    #[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
    #[serde(default)]
    pub struct ArmSwing {
        /// Peak torque.
        pub amplitude: f64 [-1e3, 1e3, "N m"] = 30.0,
    }
}

/// Readings of t2, the beginning of the cosines of states 14 and 16.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum PushOffStart {
    /// The supporting foot begins to rotate while the free foot is flat: 15 -> 16 or 7 -> 16.
    Rotation,
    /// The free foot becomes flat: 7 -> 15 or 7 -> 16.
    Flat,
}

impl Numbers for PushOffStart {}
