//! An attempted time step, and the end of one that was computed in lanes.

use crate::{
    events::guards::MAX_GUARDS,
    integrate::{Method, TimeStep},
    model::state::State,
    rhs::sole_points::SolePoints,
    sim::NY,
};

/// Maximum time step [s]. In a longer one, the values of a guard at two stages and at both ends may not show that it
/// touches zero.
const MAX_STEP: f64 = 0.02;

/// An attempted time step.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Trial {
    pub method: Method,
    /// End time of the motion [s].
    pub until: f64,
    /// Length that the error control asks for, and that of the attempt [s].
    pub wanted: f64,
    pub h: f64,
}

impl Trial {
    /// The first attempt from a state.
    pub fn new(state: &State, method: Method, until: f64) -> Self {
        let wanted = method.step().unwrap_or(state.h.min(MAX_STEP));
        Self {
            method,
            until,
            wanted,
            h: wanted,
        }
    }

    /// Set the length from the wanted one and the time left, so that no tiny last step remains.
    pub fn shorten(&mut self, t: f64) {
        let (h, left) = (self.wanted, self.until - t);
        self.h = if self.method.step().is_some() {
            left / (left / h - 1e-9).ceil().max(1.0)
        } else if h > left * (1.0 - 1e-9) {
            left
        } else if h > 0.5 * left {
            0.5 * left
        } else {
            h
        };
    }
}

/// Place of the evaluation `Simulation::eval` in the attempted step.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) enum Evaluated {
    /// At this fraction of the step.
    At(f64),
    /// Lanes have evaluated at its end: only the contact forces are of that place.
    EndInLanes,
    Elsewhere,
}

/// End of a step that was computed in lanes.
pub(crate) struct EndPoint<'a> {
    pub guards: [f64; MAX_GUARDS],
    pub sole_points: SolePoints,
    /// The free foot violates its constraints.
    pub is_violated: bool,
    /// Copies the slopes that the dense output needs.
    pub copy_slopes: &'a dyn Fn(&mut TimeStep<NY>),
}
