//! Points of a motion at which a derivative does not exist, or is not to be trusted.

use crate::{
    derivatives::{
        saltation::{EventDerivative, EventGroup},
        tape::Record,
    },
    events::{
        guard::Guard,
        observer::{Operation, StepEnd},
    },
    model::{
        Model,
        contact_mode::{ContactMode, End, FREE, SUPPORT},
    },
};
use nalgebra::DVector;

/// Margins below which a point counts as non-smooth. Guards: rate per second and value, gaps and speeds in m and
/// m/s, forces relative to the weight. Times in s, angles in rad.
const GRAZING: f64 = 1e-4;
const VALUE: f64 = 1e-6;
const TIME: f64 = 1e-7;
const ANGLE: f64 = 1e-7;
/// A displacement of the start state that moves an event's time past a margin is small below this [m, rad, m/s, rad/s].
const DISPLACEMENT: f64 = 1e-6;

/// Why a derivative may not exist.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Reason {
    /// A guard touches zero with almost no rate.
    Grazing,
    /// Two events almost at one instant, or two ends that land at once.
    Simultaneous,
    /// A guard of the new mode starts almost at zero: another mode is almost consistent.
    ModeChange,
    /// A controller sample almost at a switch, or an event almost at a sample.
    Sample,
    /// Contact constraints depend on each other.
    Dependent,
    /// Time stepping: a change of contact, which is differentiated in part.
    ContactChange,
}

impl Reason {
    pub fn name(self) -> &'static str {
        match self {
            Self::Grazing => "grazing",
            Self::Simultaneous => "simultaneous",
            Self::ModeChange => "mode_change",
            Self::Sample => "sample",
            Self::Dependent => "dependent",
            Self::ContactChange => "contact_change",
        }
    }
}

/// A non-smooth point.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Nonsmooth {
    pub reason: Reason,
    /// [s]
    pub t: f64,
    /// Distance from the non-smooth point, in the unit of the reason.
    pub margin: f64,
}

/// Unit of a guard.
fn scale(model: &Model, guard: Guard) -> f64 {
    if guard.is_kinematic() {
        1.0
    } else {
        model.weight()
    }
}

/// Number of ends of the soles that are closed, and were open in the mode `before`.
fn landings(before: ContactMode, closed: ContactMode) -> usize {
    let ends = |which: usize| {
        let [old, new] = [before, closed].map(|mode| mode.foot(which).touch);
        let landed = move |end: &End| new.has(*end) && !old.has(*end);
        [End::Heel, End::Toe]
            .iter()
            .filter(|end| landed(end))
            .count()
    };
    ends(SUPPORT) + ends(FREE)
}

/// Non-smooth points of a recorded motion. The events come with their derivatives; `nearest` is the guard that is
/// nearest to zero at the start.
pub fn find(
    model: &Model,
    records: &[Record],
    events: (&[EventGroup<'_>], &[EventDerivative]),
    (start, nearest): (f64, Option<(Guard, f64)>),
) -> Vec<Nonsmooth> {
    let mut found = Vec::new();
    let mut check = |reason, t, margin: f64, least: f64| {
        if margin.is_nan() || margin.abs() < least {
            found.push(Nonsmooth { reason, t, margin });
        }
    };
    if let Some((guard, value)) = nearest {
        check(
            Reason::ModeChange,
            start,
            value / scale(model, guard),
            VALUE,
        );
    }
    let period = model.scene.control.sample_period;
    let samples = !model.controller_terms.is_empty();
    let least_time = |slope: &DVector<f64>| TIME.max(DISPLACEMENT * slope.norm());
    let mut last: Option<&EventDerivative> = None;
    for (group, event) in events.0.iter().zip(events.1) {
        let (guard, _, before) = group.first;
        let t = before.t;
        if let Some(rate) = event.guard_rate {
            check(Reason::Grazing, t, rate / scale(model, guard), GRAZING);
            if let Some(last) = last {
                let least = least_time(&(&event.dt_dx - &last.dt_dx));
                check(Reason::Simultaneous, t, t - last.t, least);
            }
            last = Some(event);
            if samples {
                let tick = (t / period).round() * period;
                check(Reason::Sample, t, t - tick, least_time(&event.dt_dx));
            }
        }
        let mut is_first = true;
        for record in group.records {
            match record {
                Record::Operation(Operation::CloseGaps { closed, .. })
                    if landings(before.mode, *closed) > 1 =>
                {
                    check(Reason::Simultaneous, t, 0.0, VALUE);
                }
                Record::Event(guard, value, _) => {
                    let margin = value / scale(model, *guard);
                    if !is_first {
                        check(Reason::Simultaneous, t, margin, VALUE);
                    } else if matches!(guard, Guard::Wedge(_)) && margin > VALUE {
                        // A singular point of a sliding contact, at which no guard is zero.
                        check(Reason::Dependent, t, 0.0, VALUE);
                    }
                    is_first = false;
                }
                Record::EventEnds(_, Some((guard, value))) => {
                    check(Reason::ModeChange, t, value / scale(model, *guard), VALUE);
                }
                _ => {}
            }
        }
    }
    let in_steps = records.iter().any(|r| matches!(r, Record::TimeStep(_)));
    let mut now = start;
    for record in records {
        match record {
            Record::TimeStep(step) => now = step.after.t,
            Record::Operation(Operation::Changed) if in_steps => {
                check(Reason::ContactChange, now, 0.0, VALUE)
            }
            _ => {}
        }
        if let Record::Step(step) = record {
            check(Reason::Sample, step.start.t, step.switch_margin, ANGLE);
            if step.theta * step.h <= 0.0 && matches!(step.end, StepEnd::Guard(_)) {
                check(Reason::ModeChange, step.start.t, 0.0, VALUE);
            }
        }
    }
    found
}
