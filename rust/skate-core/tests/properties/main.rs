//! Laws that hold whatever the state, the torques, the scene and the order of calls: proptest draws them.
#![allow(non_snake_case)]

mod calls;
mod choice;
mod draw;
mod energy;
mod impacts;
