//! Advancing simulations in time, one or a batch, by the scheme of the model.

use crate::{
    error::Termination,
    integrate::Method,
    model::scheme::{Methods, Scheme},
    numeric::simd::Width,
    sim::{
        EventDriver, Simulation,
        lanes::{HasSimulation, MAX_BATCH, MAX_WAITING_BATCH, advance_in_lanes},
    },
    time_stepping::StepDriver,
};

/// Advance simulations of one scene, which may differ in their parameters, each to its own end time. The
/// results equal those of `Simulation::advance` on one after the other. The iterator is polled as lanes
/// become free; `finished` receives the finished simulations in arbitrary order. `scheme` is the scene's.
pub fn advance_many<P: HasSimulation>(
    simulations: impl Iterator<Item = (P, f64)>,
    scheme: Scheme,
    (width, max_batch): (Width, usize),
    mut finished: impl FnMut(P),
) {
    let alone = |sim: &mut Simulation, until| sim.advance(until);
    let limits = (width, max_batch);
    match scheme {
        Scheme::TimeStepping { .. } => {
            advance_in_lanes::<StepDriver, _, MAX_BATCH>(simulations, limits, alone, finished);
        }
        Scheme::EventDriven(Methods {
            usual: Method::Dop853(_),
            ..
        }) => {
            advance_in_lanes::<EventDriver, _, MAX_WAITING_BATCH>(
                simulations,
                limits,
                alone,
                finished,
            );
        }
        Scheme::EventDriven(_) => simulations.for_each(|(mut simulation, until)| {
            simulation.sim_mut().advance(until);
            finished(simulation);
        }),
    }
}

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
