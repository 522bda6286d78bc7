//! Property tests with random states, torques, scenes and call sequences, by proptest.
#![allow(non_snake_case)]

mod calls;
mod choice;
mod draw;
mod energy;
mod impacts;
