//! Onwards in time: one simulation, or many in company.

use crate::{
    error::Termination,
    numeric::{prefetch::prefetch, simd::Width},
    scene::{Accuracy, Way},
    sim::{
        Simulation,
        moreau::{self, HasSimulation},
    },
};

/// Advance simulations of one scene, which may differ in its numbers, each to its own time: the same as
/// `Simulation::advance` for one after the other. Passengers are asked for as there is room for them, and
/// handed back as they arrive, in no order. `accuracy` is the scene's.
pub fn advance_many<P: HasSimulation>(
    passengers: impl Iterator<Item = (P, f64)>,
    accuracy: Accuracy,
    (width, most): (Width, usize),
    mut arrived: impl FnMut(P),
) {
    match accuracy.way() {
        Way::TimeSteps { .. } => moreau::advance_many(passengers, (width, most), arrived),
        Way::Events(_) => passengers.for_each(|(mut passenger, until)| {
            passenger.sim_mut().advance(until);
            arrived(passenger);
        }),
    }
}

/// `Simulation::step_once` of each, in company as in a batch.
///
/// # Errors
/// Why one cannot go on.
pub(crate) fn step_many(sims: &mut [Simulation], accuracy: Accuracy) -> Result<(), Termination> {
    let Way::TimeSteps { step } = accuracy.way() else {
        return sims.iter_mut().try_for_each(Simulation::step_once);
    };
    let passengers = sims.iter_mut().map(|sim| {
        let until = sim.step_end(step);
        (sim, until)
    });
    moreau::advance_many(passengers, (Width::widest(), usize::MAX), drop);
    sims.iter().find_map(|sim| sim.ended).map_or(Ok(()), Err)
}

impl Simulation {
    /// Advance to the time `until`, or to the end that `ended` names.
    pub fn advance(&mut self, until: f64) {
        match self.model.scene.accuracy.way() {
            Way::TimeSteps { .. } => self.advance_by_steps(until),
            Way::Events(method) => {
                if self.ended.is_none() && self.state.t < until {
                    self.budget.add_call();
                }
                while self.ended.is_none() && self.state.t < until {
                    self.ended = self.advance_once(method, until).err();
                }
                self.update_counters();
            }
        }
    }

    /// One step of the scene's own method: a whole one of time-stepping, with the events in it.
    ///
    /// # Errors
    /// Why the simulation cannot go on.
    pub(crate) fn step_once(&mut self) -> Result<(), Termination> {
        match self.model.scene.accuracy.way() {
            Way::TimeSteps { step } => {
                self.advance_by_steps(self.step_end(step));
                self.ended.map_or(Ok(()), Err)
            }
            Way::Events(method) => self.advance_once(method, self.next_action_time()),
        }
    }

    /// When a time step from the present state ends: with the action at the latest [s].
    fn step_end(&self, step: f64) -> f64 {
        let end = self.next_action_time();
        let left = end - self.state.t;
        let h = self.time_step(left, step);
        if h < left { self.state.t + h } else { end }
    }

    /// Ask for what a time step begins with.
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

    /// Ask for what an event needs, once the above is here.
    #[inline]
    pub(crate) fn prefetch_log(&self) {
        self.events.prefetch();
    }
}
