//! Tape of a motion: its accepted time steps, and what events do to the state.

use crate::{
    control::feedforward::Q_E_SWING,
    events::{
        guard::Guard,
        observer::{AcceptedStep, Observer, Operation, Present, StepEnd},
    },
    model::{
        contact_mode::{ContactMode, Foot, SoleContact},
        controller_state::{Phase, tick_rounding},
        controller_terms::Term,
        state::State,
    },
    rhs::{StepContext, sole_points::SolePoints},
    scene::Leg,
    sim::gait_statistics::is_loaded,
};

/// Vertical speed above which an end leaves the ice; it grazes it below [m/s].
const LEAVES: f64 = 1e-4;

/// One entry.
#[derive(Debug, Clone)]
pub enum Record {
    /// An accepted time step, or its part up to an event.
    Step(Box<StepRecord>),
    /// A step of time stepping.
    TimeStep(Box<TimeStepRecord>),
    /// Totals that the step before has added to: loaded slide, time of flight.
    Counted {
        slide: bool,
        flight: bool,
    },
    /// The event of a guard begins; its value and the state before.
    Event(Guard, f64, Box<State>),
    /// The event is over; the state after it, and the guard of the new mode that is nearest to zero.
    EventEnds(Box<State>, Option<(Guard, f64)>),
    Operation(Operation),
}

/// An accepted time step; see `AcceptedStep`.
#[derive(Debug, Clone)]
pub struct StepRecord {
    pub start: State,
    pub context: StepContext,
    pub h: f64,
    pub share: f64,
    pub theta: f64,
    pub end: StepEnd,
    /// Least distance of the free foot's angle from a switch of Eq. 21 at a controller sample [rad].
    pub switch_margin: f64,
    pub after: State,
}

/// A step of time stepping, without what happens before and after it.
#[derive(Debug, Clone)]
pub struct TimeStepRecord {
    pub start: State,
    /// [s]
    pub h: f64,
    /// As in `AcceptedStep`.
    pub share: f64,
    /// Landing that ends it.
    pub landing: Option<Guard>,
    /// State at the end.
    pub after: State,
}

/// The entries in order.
#[derive(Debug, Clone, Default)]
pub struct Tape {
    pub records: Vec<Record>,
}

impl Tape {
    /// The totals that the last step has added to.
    fn count(&mut self, present: &Present<'_>) {
        let mode = present.state.mode;
        let [support, _] = present.eval.loads(present.model, mode);
        let in_air = |foot: Foot| foot.touch == SoleContact::Air;
        self.records.push(Record::Counted {
            slide: mode.support.slides() && is_loaded(present.model, support),
            flight: in_air(mode.support) && in_air(mode.free),
        });
    }
}

impl Observer for Tape {
    fn operation(&mut self, operation: Operation) {
        self.records.push(Record::Operation(operation));
    }

    fn step(&mut self, present: &Present<'_>, step: &AcceptedStep<'_>) {
        self.records.push(Record::Step(Box::new(StepRecord {
            start: *step.before,
            context: StepContext::of(present.model, step.before, present.residual),
            h: step.h,
            share: step.share,
            theta: step.theta,
            end: step.end,
            switch_margin: switch_margin(present, step),
            after: *step.after,
        })));
        let mode = present.state.mode;
        if mode.free.touch != SoleContact::Air {
            self.operation(Operation::Project(mode));
        }
        self.count(present);
    }

    fn time_step(
        &mut self,
        present: &Present<'_>,
        start: &State,
        (h, share): (f64, f64),
        landing: Option<Guard>,
    ) {
        self.records.push(Record::TimeStep(Box::new(TimeStepRecord {
            start: *start,
            h,
            share,
            landing,
            after: *present.state,
        })));
        self.count(present);
    }

    fn event(&mut self, present: &Present<'_>, guard: Guard) {
        let mut known = present.guards.iter().zip(present.values);
        let value = known.find(|(known, _)| **known == guard);
        let value = value.map_or(0.0, |(_, value)| *value);
        let before = Box::new(*present.state);
        self.records.push(Record::Event(guard, value, before));
    }

    fn event_ends(&mut self, present: &Present<'_>, passed: Guard, before: (ContactMode, Leg)) {
        let nearest = nearest_guard(present, |guard| {
            !guard.is_reverse_of(passed) && !has_left(present, guard, before)
        });
        let after = Box::new(*present.state);
        self.records.push(Record::EventEnds(after, nearest));
    }
}

/// Of the guards that bind from the start of a mode, and that `counts`, the one nearest to zero. A foot may start to slide
/// from rest, and under a large load.
pub fn nearest_guard(
    present: &Present<'_>,
    counts: impl Fn(Guard) -> bool,
) -> Option<(Guard, f64)> {
    let values = present.guards.iter().zip(present.values);
    let values = values.map(|(&guard, &value)| (guard, value));
    let bound = values.filter(|&(guard, _)| {
        let is_free = matches!(guard, Guard::Reversal(_) | Guard::Wedge(_));
        !is_free && guard.binds_at_start(present.model) && counts(guard)
    });
    bound.min_by(|a, b| a.1.abs().total_cmp(&b.1.abs()))
}

/// Least distance of the free foot's angle from a switch of Eq. 21 at the samples of the attempted step, up to its end;
/// infinity without samples.
fn switch_margin(present: &Present<'_>, step: &AcceptedStep<'_>) -> f64 {
    let (model, before) = (present.model, step.before);
    let terms = &model.controller_terms;
    let has_law = terms.iter().any(|t| matches!(t, Term::Feedforward(_)));
    let switch = match Phase::of(before.mode).filter(|_| has_law) {
        Some(Phase::Swing) => Q_E_SWING,
        Some(Phase::Touched) => 0.0,
        _ => return f64::INFINITY,
    };
    let period = model.scene.control.sample_period;
    let (mut tick, rounding) = ((before.t / period).floor(), tick_rounding(before.t));
    let mut least = f64::INFINITY;
    loop {
        let ahead = tick * period - before.t;
        if ahead > step.theta * step.h + rounding {
            return least;
        }
        if ahead > rounding {
            let at = (ahead / step.h).min(1.0);
            least = least.min(((step.free_foot_angle)(at) - switch).abs());
        }
        tick += 1.0;
    }
}

/// Is this the gap of an end that the event has set in motion off the ice? It is zero by construction.
fn has_left(present: &Present<'_>, guard: Guard, (from, leg): (ContactMode, Leg)) -> bool {
    let Guard::Gap(which, end) = guard else {
        return false;
    };
    let State { q, mode, .. } = present.state;
    let had = if present.state.support_leg == leg {
        which
    } else {
        1 - which
    };
    let points = SolePoints::of_one(present.model, &present.eval.kin, *mode, q[1]);
    from.foot(had).touch.has(end) && points.speeds[which][end as usize][1] > LEAVES
}
