//! Property tests with random states, torques, scenes and call sequences, by proptest.
#![allow(non_snake_case)]

mod call_sequences;
mod energy;
mod impacts;
mod mode_selection;
mod strategies;
