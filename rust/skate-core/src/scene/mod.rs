//! A scene: the complete description of a simulation.
//!
//! A table that is absent is an effect that is off: no `[control.lifting]`, no lifting. Each table has a
//! file. `declaration` defines how a table states the range, unit and default of its numbers; choices that
//! contradict each other are listed in `rules`, and all effects in `effects`.

mod accuracy;
pub mod body;
mod contact;
mod control;
mod declaration;
pub mod effects;
mod ice;
mod json;
mod numbers;
pub mod ranges;
mod read;
mod rules;
mod stabilizers;
mod start;

pub use accuracy::{Accuracy, AccuracyName, TimeStepping};
pub use contact::{Contact, ContactLaw, PulledFriction};
pub use control::{ArmSwing, Control, Feedforward, Lifting, PushOffStart};
pub use ice::{Friction, Ice};
pub use stabilizers::{HeadDamping, KneeStop, ProportionalDerivative, Stabilizers};
pub use start::{COORDINATES, Leg, Start};

use crate::scene::{
    body::Body,
    declaration::{Numbers, table},
};
use serde::{Deserialize, Serialize};
use std::collections::BTreeMap;

table! {
    /// See the documentation of the module. The default is the body of Table 1, which stands on the paper's
    /// ice without a controller.
    #[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
    pub struct Scene {
        pub name: String = "standing".into(),
        /// One line of text.
        pub description: String = String::new(),
        /// Source of the numbers that the paper does not give.
        pub provenance: String = String::new(),
        pub accuracy: Accuracy = Accuracy::Named(AccuracyName::Balanced),
        /// Integrate the work of torques, damping and friction, and sum the energy losses of impacts.
        pub energy_balance: bool = true,
        /// Joints of q8 .. q17 that are held at zero; their links merge into the parent.
        pub locked: Vec<String> = Vec::new(),
        pub body: Body = Body::default(),
        pub ice: Ice = Ice::default(),
        pub contact: Contact = Contact::default(),
        pub control: Control = Control::default(),
        pub stabilizers: Stabilizers = Stabilizers::default(),
        pub fall: Option<Fall> = None,
        pub start: Start = Start::default(),
        /// Numbers that the environment draws for every episode, uniformly from [lowest, highest]; named as in
        /// `parameters`. A simulation uses the numbers of the tables above.
        pub randomise: BTreeMap<String, [f64; 2]> = BTreeMap::new(),
    }
}

table! {
    /// Conditions of a fall: the head too low, or a knee or an ankle below the ice.
    #[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
    pub struct Fall {
        /// Lowest admissible height of the top of the head.
        pub head_height: f64 [-10.0, 3.0, "m"],
    }
}

/// These are ranges of numbers, not numbers.
impl Numbers for BTreeMap<String, [f64; 2]> {}
