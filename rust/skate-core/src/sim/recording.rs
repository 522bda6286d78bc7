//! Recording of a motion for its derivative; see `events::trace`.

use crate::{
    control::feedforward::Q_E_SWING,
    events::{
        guard::Guard,
        trace::{Record, StepEnd, StepRecord, TimeStepRecord},
    },
    integrate::Method,
    model::{
        contact_mode::{ContactMode, Foot, SoleContact},
        controller_state::{Phase, TICK_ROUNDING},
        controller_terms::Term,
        state::State,
    },
    rhs::{StepContext, sole_points::SolePoints},
    scene::Leg,
    sim::{Simulation, event_location::StepEvent, gait_statistics::is_loaded},
};

/// Vertical speed above which an end leaves the ice; it grazes it below [m/s].
const LEAVES: f64 = 1e-4;

impl Simulation {
    #[inline]
    pub(super) fn trace(&mut self, record: Record) {
        if let Some(trace) = &mut self.trace {
            trace.records.push(record);
        }
    }

    /// Record an accepted step from `before` to `after`, on the way to `until`, of which the part `theta` was made.
    #[inline(never)]
    pub(super) fn trace_step(
        &mut self,
        method: Method,
        (h, theta): (f64, f64),
        event: Option<StepEvent>,
        (before, after, until): (&State, &State, f64),
    ) {
        let left = until - before.t;
        // `attempt` derives these lengths from the time that is left.
        let is_share = method.step().is_some() || h == left || h == 0.5 * left;
        let end = match event {
            Some(StepEvent::Guard(guard)) => StepEnd::Guard(guard),
            Some(StepEvent::Sample) => StepEnd::Sample,
            None if after.t >= until => StepEnd::Until,
            None => StepEnd::Length,
        };
        let context = StepContext::of(&self.model, before, &self.residual);
        self.trace(Record::Step(Box::new(StepRecord {
            start: *before,
            context,
            h,
            share: if is_share { h / left } else { 0.0 },
            theta,
            end,
            switch_margin: self.switch_margin(before, theta),
            after: *after,
        })));
        if self.state.mode.free.touch != SoleContact::Air {
            self.trace(Record::Project(self.state.mode));
        }
    }

    /// Record that the contact has changed.
    #[inline]
    pub(super) fn trace_changed(&mut self) {
        if self.trace.is_some() {
            self.trace(Record::Changed);
        }
    }

    /// Record a step of time stepping from `start`, which has the length `h` with the given `share`.
    #[inline]
    pub(crate) fn trace_time_step(
        &mut self,
        start: &State,
        (h, share): (f64, f64),
        event: Option<Guard>,
    ) {
        if self.trace.is_some() {
            self.trace(Record::TimeStep(Box::new(TimeStepRecord {
                start: *start,
                residual: self.residual,
                h,
                share,
                landing: event.filter(|guard| matches!(guard, Guard::Gap(..))),
                after: self.state,
            })));
        }
    }

    /// Record the totals that the last step has added to.
    #[inline]
    pub(crate) fn trace_counted(&mut self) {
        if self.trace.is_some() {
            let mode = self.state.mode;
            let [support, _] = self.eval.loads(&self.model, mode);
            let in_air = |foot: Foot| foot.touch == SoleContact::Air;
            self.trace(Record::Counted {
                slide: mode.support.slides() && is_loaded(&self.model, support),
                flight: in_air(mode.support) && in_air(mode.free),
            });
        }
    }

    /// Least distance of the free foot's angle from a switch of Eq. 21 at the samples of the attempted step, up
    /// to the fraction `theta`; infinity without samples.
    fn switch_margin(&self, before: &State, theta: f64) -> f64 {
        let terms = &self.model.controller_terms;
        let has_law = terms.iter().any(|t| matches!(t, Term::Feedforward(_)));
        let switch = match Phase::of(before.mode).filter(|_| has_law) {
            Some(Phase::Swing) => Q_E_SWING,
            Some(Phase::Touched) => 0.0,
            _ => return f64::INFINITY,
        };
        let period = self.model.scene.control.sample_period;
        let mut tick = (before.t / period).floor();
        let mut least = f64::INFINITY;
        loop {
            let ahead = tick * period - before.t;
            if ahead > theta * self.step.h + TICK_ROUNDING {
                return least;
            }
            if ahead > TICK_ROUNDING {
                let at = (ahead / self.step.h).min(1.0);
                least = least.min((self.free_foot_angle(at) - switch).abs());
            }
            tick += 1.0;
        }
    }

    /// Record that the event of a guard begins.
    #[inline]
    pub(super) fn trace_event(&mut self, guard: Guard) {
        if self.trace.is_some() {
            let known = self.guards.as_slice().iter().zip(self.values);
            let value = known.clone().find(|(known, _)| **known == guard);
            let value = value.map_or(0.0, |(_, value)| value);
            let record = Record::Event(guard, value, Box::new(self.state));
            self.trace(record);
        }
    }

    /// Of the guards that bind from the start of a mode, and that `counts`, the one nearest to zero.
    pub(crate) fn nearest_guard(&self, counts: impl Fn(Guard) -> bool) -> Option<(Guard, f64)> {
        let values = self.guards.as_slice().iter().copied().zip(self.values);
        let bound = values.filter(|&(guard, _)| guard.binds_at_start(&self.model) && counts(guard));
        bound.min_by(|a, b| a.1.abs().total_cmp(&b.1.abs()))
    }

    /// Record that the event of the guard `passed` is over; mode and supporting leg before it.
    #[inline]
    pub(super) fn trace_event_end(&mut self, passed: Guard, before: (ContactMode, Leg)) {
        if self.trace.is_some() {
            let nearest = self.nearest_guard(|guard| {
                !guard.is_reverse_of(passed) && !self.has_left(guard, before)
            });
            let record = Record::EventEnds(Box::new(self.state), nearest);
            self.trace(record);
        }
    }

    /// Is this the gap of an end that the event has set in motion off the ice? It is zero by construction.
    fn has_left(&self, guard: Guard, (from, leg): (ContactMode, Leg)) -> bool {
        let Guard::Gap(which, end) = guard else {
            return false;
        };
        let State { q, mode, .. } = self.state;
        let had = if self.state.support_leg == leg {
            which
        } else {
            1 - which
        };
        let points = SolePoints::of_one(&self.model, &self.eval.kin, mode, q[1]);
        from.foot(had).touch.has(end) && points.speeds[which][end as usize][1] > LEAVES
    }
}
