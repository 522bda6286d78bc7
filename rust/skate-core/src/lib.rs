//! A 17-link humanoid skating on ice, after Zhang et al., "Ice Skating Motion Using Feedforward
//! Control System by Model of Humanoid Robot".
//!
//! Data takes one way: [`scene::Scene`] -> [`model::Model`] -> torque ([`control`]) -> accelerations
//! and contact forces ([`evaluate`]) -> step ([`integrate`]) -> event ([`guards`], [`transition`]) ->
//! what a person or a learner sees ([`sim::Simulation`]).
#![doc = include_str!("notation.md")]
// The literature's names: M, J, S, K_p.
#![allow(non_snake_case)]
// Loops over coordinates index several arrays at once; iterators would hide which.
#![allow(clippy::needless_range_loop)]

mod angles;
pub mod articulated;
pub mod batch;
pub mod contact;
pub mod control;
pub mod draw;
pub mod dynamics;
pub mod error;
pub mod evaluate;
pub mod factored;
mod fetch;
pub mod guards;
pub mod implicit;
pub mod inertial;
pub mod integrate;
pub mod kinematics;
pub mod lanes;
pub mod marks;
pub mod measure;
pub mod model;
pub mod monitor;
pub mod packed;
pub mod params;
pub mod planar;
pub mod project;
pub mod real;
pub mod relabel;
pub mod scene;
pub mod sim;
pub mod snapshot;
pub mod spatial;
pub mod state;
pub mod task;
pub mod three;
pub mod transition;
pub mod trunk;
