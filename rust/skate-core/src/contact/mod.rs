//! Feet and ice: contact states, contact forces, and which state comes next.

pub mod friction;
pub mod mode;
pub mod problem;
pub mod select;

pub use friction::FrictionLaw;
pub use mode::{Foot, Grip, Mode, TABLE_2, Touch};
pub use problem::{ContactProblem, PHI, Slip, Solution, Y, Z};
