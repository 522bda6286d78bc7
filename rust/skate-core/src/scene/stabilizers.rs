//! Controller terms that the paper does not have.

use crate::scene::declaration::table;
use serde::{Deserialize, Serialize};

table! {
    /// Controller terms that the paper does not have. An absent table is a term that is off.
    #[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
    pub struct Stabilizers {
        /// Force on the head against its velocity relative to the supporting ankle, through J_h^T.
        pub head_damping: Option<HeadDamping> = None,
        /// Torque on the supporting hip towards a pitch of the waist.
        pub hip_pd: Option<ProportionalDerivative> = None,
        /// Torque on the free knee towards an angle, states 1 to 4.
        pub free_knee_pd: Option<ProportionalDerivative> = None,
        /// Torque on a knee that bends backward, continuous at zero: K q (1 + c q'), q > 0.
        pub knee_stop: Option<KneeStop> = None,
    }
}

table! {
    /// See `Stabilizers::head_damping`.
    #[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
    pub struct HeadDamping {
        /// Forward force per speed.
        pub y: f64 [0.0, 1e6, "N s/m"],
        /// Vertical force per speed.
        pub z: f64 [0.0, 1e6, "N s/m"],
    }
}

table! {
    /// Torque gain (reference - angle) - damping rate.
    #[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
    pub struct ProportionalDerivative {
        pub gain: f64 [0.0, 1e6, "N m/rad"],
        /// Angle at which the proportional part is zero.
        pub reference: f64 [-4.0, 4.0, "rad"],
        pub damping: f64 [0.0, 1e6, "N m s/rad"],
    }
}

impl ProportionalDerivative {
    /// With the reference angle zero.
    pub fn new(gain: f64, damping: f64) -> Self {
        Self {
            gain,
            reference: 0.0,
            damping,
        }
    }
}

table! {
    /// See `Stabilizers::knee_stop`; Hunt and Crossley (1975), eq. 12 with exponent 1.
    #[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
    pub struct KneeStop {
        /// K.
        pub stiffness: f64 [0.0, 1e6, "N m/rad"],
        /// c.
        pub damping: f64 [0.0, 10.0, "s/rad"],
    }
}
