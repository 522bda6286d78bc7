//! A 17-link humanoid skating on ice, after Zhang et al., "Ice Skating Motion Using Feedforward
//! Control System by Model of Humanoid Robot".
//!
//! Data flows one way: [`scene::Scene`] -> [`model::Model`] -> torque ([`control`]) -> accelerations and contact
//! forces ([`rhs`]) -> step ([`integrate`], or [`time_stepping`]) -> event ([`events`]) -> observation and reward
//! ([`task`]).
//!
//! Layers from the bottom to the top; a file imports from its own layer and from those below (`tests/layers.rs`):
//! [`error`], [`numeric`], [`integrate`], [`scene`], [`model`], [`contact`], [`dynamics`], [`control`], [`rhs`],
//! [`events`], [`sim`], [`time_stepping`], [`advance`], [`laws`], [`lanes`], [`derivatives`], [`task`], [`batch`],
//! [`timing`].
#![cfg_attr(not(test), deny(clippy::disallowed_methods))]
#![doc = include_str!("notation.md")]
// The literature's names: M, J, S, K_p.
#![allow(non_snake_case)]
// Loops over coordinates index several arrays at once; iterators would hide which.
#![allow(clippy::needless_range_loop)]

pub mod advance;
pub mod batch;
pub mod contact;
pub mod control;
pub mod derivatives;
pub mod dynamics;
pub mod error;
pub mod events;
pub mod integrate;
pub mod lanes;
pub mod laws;
pub mod model;
pub mod numeric;
pub mod rhs;
pub mod scene;
pub mod sim;
pub mod task;
pub mod time_stepping;
pub mod timing;
