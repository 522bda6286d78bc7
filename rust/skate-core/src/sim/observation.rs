//! The observer of a motion.

use crate::{
    events::{
        guard::Guard,
        observer::{AcceptedStep, Observer, Operation, Present, StepEnd},
    },
    integrate::Method,
    model::state::State,
    sim::{Simulation, event_location::StepEvent},
};
use std::any::Any;

/// The observer, if there is one.
#[derive(Debug, Default)]
pub(crate) struct Observed(pub Option<Box<dyn Observer>>);

impl Clone for Observed {
    fn clone(&self) -> Self {
        Self(self.0.as_ref().and_then(|observer| observer.copy()))
    }
}

impl<T: Observer> From<Option<T>> for Observed {
    fn from(observer: Option<T>) -> Self {
        Self(observer.map(|observer| Box::new(observer) as Box<dyn Observer>))
    }
}

impl Observed {
    /// The observer, if it is of the type `T`.
    pub fn get<T: Observer>(&self) -> Option<&T> {
        let observer: &dyn Any = self.0.as_deref()?;
        observer.downcast_ref()
    }
}

impl Simulation {
    /// Remove the observer, which is of the type `T`.
    pub(crate) fn take_observer<T: Observer>(&mut self) -> Option<Box<T>> {
        let observer: Box<dyn Any> = self.observer.0.take()?;
        observer.downcast().ok()
    }

    /// What an observer is shown.
    pub(crate) fn present(&self) -> Present<'_> {
        let guards = self.guards.as_slice();
        Present {
            model: &self.model,
            state: &self.state,
            residual: &self.residual,
            eval: &self.eval,
            guards,
            values: &self.values[..guards.len()],
        }
    }

    /// Call `tell` if there is an observer.
    #[inline]
    pub(super) fn observe(&mut self, tell: impl FnOnce(&mut dyn Observer, &Self)) {
        if self.observer.0.is_some() {
            self.tell_observer(tell);
        }
    }

    #[cold]
    #[inline(never)]
    fn tell_observer(&mut self, tell: impl FnOnce(&mut dyn Observer, &Self)) {
        if let Some(mut observer) = self.observer.0.take() {
            tell(&mut *observer, self);
            self.observer.0 = Some(observer);
        }
    }

    /// The state has changed without an event.
    #[inline]
    pub(crate) fn observe_beginning(&mut self) {
        self.observe(|observer, sim| observer.begins(&sim.model, &sim.state));
    }

    #[inline]
    pub(super) fn observe_operation(&mut self, operation: Operation) {
        self.observe(|observer, _| observer.operation(operation));
    }

    /// An accepted step from `before` to `after`, on the way to `until`, of which the part `theta` was made.
    pub(super) fn observe_step(
        &mut self,
        method: Method,
        (h, theta): (f64, f64),
        event: Option<StepEvent>,
        (before, after, until): (&State, &State, f64),
    ) {
        self.observe(|observer, sim| {
            let left = until - before.t;
            // `attempt` derives these lengths from the time that is left.
            let is_share = method.step().is_some() || h == left || h == 0.5 * left;
            let step = AcceptedStep {
                before,
                after,
                h,
                theta,
                share: if is_share { h / left } else { 0.0 },
                end: match event {
                    Some(StepEvent::Guard(guard)) => StepEnd::Guard(guard),
                    Some(StepEvent::Sample) => StepEnd::Sample,
                    None if after.t >= until => StepEnd::Until,
                    None => StepEnd::Length,
                },
                free_foot_angle: &|theta| sim.free_foot_angle(theta),
            };
            observer.step(&sim.present(), &step);
        });
    }

    /// A step of time stepping from `start`, which has the length `h` with the given `share`.
    pub(crate) fn observe_time_step(
        &mut self,
        start: &State,
        lengths: (f64, f64),
        event: Option<Guard>,
    ) {
        let landing = event.filter(|guard| matches!(guard, Guard::Gap(..)));
        self.observe(|observer, sim| observer.time_step(&sim.present(), start, lengths, landing));
    }
}
