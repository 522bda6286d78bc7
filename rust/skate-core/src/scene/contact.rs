//! Contact between feet and ice.

use crate::scene::declaration::{Numbers, table};
use serde::{Deserialize, Serialize};

table! {
    /// Contact between feet and ice.
    #[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
    pub struct Contact {
        pub law: ContactLaw = ContactLaw::TwoWay,
        /// The supporting foot may rotate about its toe or heel: q1. Must be true with push-only contact.
        pub foot_rotation: bool = true,
        /// The free foot touches the ice; otherwise it passes through.
        pub free_foot: bool = true,
        /// Two-way contact only: the free toe may touch alone, which Table 2 does not contain. With push-only
        /// contact either end of a sole may touch.
        pub toe_contact: bool = false,
        /// Ends of a sole land. Otherwise a contact that has opened stays open.
        pub impacts: bool = true,
        /// Two-way contact only: friction of the free foot while its normal force pulls.
        pub pulled_friction: PulledFriction = PulledFriction::Literal,
        /// Two-way contact only: the free heel in point contact is held even when its normal force pulls.
        pub point_contact_holds: bool = false,
        /// Two-way contact only: viscous torque on the foot that rotates about its edge, d_1 of Eq. 9.
        pub edge_damping: f64 [0.0, 1e3, "N m s/rad"] = 0.0,
    }
}

/// Contact law of all feet.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum ContactLaw {
    /// The paper's constraints hold in both directions; transitions of Table 2.
    TwoWay,
    /// Normal forces only push. Either end of a sole may touch, either foot may leave the ice.
    PushOnly,
}

/// Friction of the free foot while its normal force pulls.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum PulledFriction {
    /// Eq. 13 as printed: -mu N with a negative N accelerates the foot.
    Literal,
    /// No friction from a negative normal force.
    None,
}

impl Numbers for ContactLaw {}
impl Numbers for PulledFriction {}
