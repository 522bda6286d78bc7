//! Advancing a simulation in time by the scheme of its model.

use crate::{error::Termination, model::scheme::Scheme, sim::Simulation};

impl Simulation {
    /// Advance to the time `until` [s], or until termination; see `ended`.
    pub fn advance(&mut self, until: f64) {
        self.advance_while(until, || true);
    }

    /// `advance` until `go_on`, which is called before every time step, returns false. The state is then that at the
    /// end of the last time step.
    pub fn advance_while(&mut self, until: f64, go_on: impl FnMut() -> bool) {
        match self.model.scheme {
            Scheme::TimeStepping { .. } => self.advance_by_steps(until, go_on),
            Scheme::EventDriven(_) => self.advance_between_events(until, go_on),
        }
    }

    /// One time step of the scene's scheme, at most to the end of the action period, including the events in it.
    ///
    /// # Errors
    /// The cause of termination.
    pub(crate) fn step_once(&mut self) -> Result<(), Termination> {
        let mut steps = 0..1;
        self.advance_while(self.next_action_time(), || steps.next().is_some());
        self.ended.map_or(Ok(()), Err)
    }
}
