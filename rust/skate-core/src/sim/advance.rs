//! Advancing simulations in time: one, or a batch.

use crate::{
    error::Termination,
    integrate::Method,
    numeric::{prefetch::prefetch, simd::Width},
    scene::{Accuracy, Way},
    sim::{
        Simulation,
        event_lanes::EventDriver,
        lanes::{HasSimulation, MAX_BATCH, MAX_WAITING_BATCH, advance_in_lanes},
        moreau::StepDriver,
    },
};

/// Advance simulations of one scene, which may differ in their parameters, each to its own end time. The
/// results equal those of `Simulation::advance` on one after the other. The iterator is polled as lanes
/// become free; `finished` receives the finished simulations in arbitrary order. `accuracy` is the scene's.
pub fn advance_many<P: HasSimulation>(
    simulations: impl Iterator<Item = (P, f64)>,
    accuracy: Accuracy,
    (width, max_batch): (Width, usize),
    mut finished: impl FnMut(P),
) {
    let alone = |sim: &mut Simulation, until| sim.advance(until);
    let limits = (width, max_batch);
    match accuracy.way() {
        Way::TimeSteps { .. } => {
            advance_in_lanes::<StepDriver, _, MAX_BATCH>(simulations, limits, alone, finished);
        }
        Way::Events(Method::Dop853(_)) => {
            advance_in_lanes::<EventDriver, _, MAX_WAITING_BATCH>(
                simulations,
                limits,
                alone,
                finished,
            );
        }
        Way::Events(_) => simulations.for_each(|(mut simulation, until)| {
            simulation.sim_mut().advance(until);
            finished(simulation);
        }),
    }
}

/// `Simulation::step_once` for a batch.
///
/// # Errors
/// The termination of the first simulation that cannot continue.
pub(crate) fn step_many(sims: &mut [Simulation], accuracy: Accuracy) -> Result<(), Termination> {
    let Way::TimeSteps { step } = accuracy.way() else {
        return sims.iter_mut().try_for_each(Simulation::step_once);
    };
    let simulations = sims.iter_mut().map(|sim| {
        let until = sim.step_end(step);
        (sim, until)
    });
    advance_many(simulations, accuracy, (Width::widest(), usize::MAX), drop);
    sims.iter().find_map(|sim| sim.ended).map_or(Ok(()), Err)
}

impl Simulation {
    /// Advance to the time `until` [s], or until termination; see `ended`.
    pub fn advance(&mut self, until: f64) {
        self.advance_while(until, || true);
    }

    /// `advance` until `go_on`, which is called before every time step, returns false. The state is then that at the
    /// end of the last time step.
    pub fn advance_while(&mut self, until: f64, mut go_on: impl FnMut() -> bool) {
        match self.model.scene.accuracy.way() {
            Way::TimeSteps { .. } => self.advance_by_steps(until, go_on),
            Way::Events(_) => {
                if self.ended.is_none() && self.state.t < until {
                    self.budget.add_call();
                }
                while self.ended.is_none() && self.state.t < until && go_on() {
                    self.ended = self.advance_once(until).err();
                }
                self.update_counters();
            }
        }
    }

    /// One time step of the scene's method, including the events in it.
    ///
    /// # Errors
    /// The cause of termination.
    pub(crate) fn step_once(&mut self) -> Result<(), Termination> {
        match self.model.scene.accuracy.way() {
            Way::TimeSteps { step } => {
                self.advance_by_steps(self.step_end(step), || true);
                self.ended.map_or(Ok(()), Err)
            }
            Way::Events(_) => self.advance_once(self.next_action_time()),
        }
    }

    /// End of the next time step [s], at most the end of the action period.
    fn step_end(&self, step: f64) -> f64 {
        let end = self.next_action_time();
        let left = end - self.state.t;
        let h = self.time_step(left, step);
        if h < left { self.state.t + h } else { end }
    }

    /// Prefetch the data that a time step reads first.
    #[inline]
    pub(crate) fn prefetch(&self) {
        prefetch(&self.state);
        prefetch(&self.sole_points);
        prefetch(&self.eval.solution);
        prefetch(&self.eval.count);
        prefetch(&self.stats);
        prefetch(&self.monitor);
        prefetch(&self.residual);
        prefetch(&self.budget);
        prefetch(&self.ended);
        prefetch(&self.implicit.count);
        prefetch(&self.events);
    }

    /// Prefetch the event log; needs the data of `prefetch`.
    #[inline]
    pub(crate) fn prefetch_log(&self) {
        self.events.prefetch();
    }
}
