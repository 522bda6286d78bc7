//! Gravity and the friction of the ice.

use crate::scene::declaration::table;
use serde::{Deserialize, Serialize};

table! {
    /// The ice and the gravity field.
    #[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
    pub struct Ice {
        /// Downward acceleration.
        pub gravity: f64 [0.0, 100.0, "m/s2"] = 9.81,
        pub friction: Friction = Friction::PAPER,
    }
}

table! {
    /// Friction law of a foot that slides on the ice.
    #[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
    #[serde(tag = "kind", rename_all = "snake_case")]
    pub enum Friction {
        /// Two-way contact only: feet on the ice never slip.
        Sticking {},
        /// Dry friction that depends on the direction of sliding, section 4.1.
        Directional {
            /// Coefficient against forward sliding.
            mu_forward: f64 [0.0, 10.0, "1"],
            /// Coefficient against backward sliding.
            mu_backward: f64 [0.0, 10.0, "1"],
            /// A slower foot sticks if the friction force can hold it, section 2.2. Two-way contact only: the
            /// impulse that stops it nearly always pulls or leaves the cone.
            capture_speed: f64 [0.0, 1.0, "m/s"],
        },
        /// Dry friction with one coefficient.
        Coulomb {
            /// Coefficient of friction.
            mu: f64 [0.0, 10.0, "1"],
            /// As in `Directional`.
            capture_speed: f64 [0.0, 1.0, "m/s"],
        },
        /// Two-way contact only: a force proportional and opposite to the velocity of the supporting foot,
        /// in the matrix D of Eq. 9. The free foot slides without friction.
        Viscous {
            /// Force per speed.
            coefficient: f64 [0.0, 1e3, "N s/m"],
        },
        /// Feet slide without friction.
        None {},
    }
}

impl Friction {
    /// Section 4.1.
    pub const PAPER: Self = Self::Directional {
        mu_forward: 0.2,
        mu_backward: 0.9,
        capture_speed: 0.01,
    };
}
