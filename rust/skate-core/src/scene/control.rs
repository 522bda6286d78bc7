//! The paper's controller and its sampling periods.

use crate::scene::declaration::table;
use serde::{Deserialize, Serialize};

table! {
    /// The paper's controller and its sampling periods. An absent table is a term that is off.
    #[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
    pub struct Control {
        /// Sampling period of the switched terms of Eq. 21.
        pub sample_period: f64 [1e-5, 0.01, "s"] = 1e-3,
        /// How long a residual torque is held.
        pub action_period: f64 [1e-4, 1.0, "s"] = 0.01,
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
