//! Contact forces of both feet, and the selection of a consistent contact mode.

mod candidates;
pub mod conditions;
mod dependent;
mod elimination;
pub mod equations;
pub mod loads;
pub mod mode_query;
pub mod mode_selection;
mod variants;
