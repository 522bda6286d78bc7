//! Derivatives of a motion through its events.
//!
//! A motion is computed as usual, and a tape records its accepted steps and the operations of its events
//! (`tape`). The derivatives of these operations then give its derivatives, a register of directions at
//! a time. The time is differentiated, too: an event happens earlier or later, and the last step makes up for it.
//! `docs/gradients.md` has the mathematics.

mod columns;
mod linear;
mod linearization;
mod nonsmooth;
mod observed;
mod parameters;
mod saltation;
mod state_vector;
mod tape;
mod time_steps;
mod variation;

pub use linearization::Linearization;
pub use nonsmooth::{Nonsmooth, Reason};
pub use observed::{Observed, observed};
pub use saltation::EventDerivative;
pub use variation::state_size;
