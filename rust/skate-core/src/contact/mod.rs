//! Contact forces of both feet, and which contact mode is consistent.

pub mod equations;
pub mod mode_selection;
