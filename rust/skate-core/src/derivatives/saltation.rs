//! Saltation matrices of the events of a recorded motion.

use crate::{
    derivatives::{
        linear::Replay,
        parameters::{Parameters, Varied},
        tape::{Record, StepRecord},
        variation::{Variation, state_size},
    },
    events::{guard::Guard, observer::StepEnd},
    integrate::Method,
    model::{Model, contact_mode::ContactMode, layout::NV, state::State},
    numeric::simd::{Register, SimdTask, Width},
    rhs::StepContext,
    scene::Leg,
};
use nalgebra::{DMatrix, DVector};

/// An event with its derivatives. Several guards are zero at one instant where one reset causes the next event.
#[derive(Debug, Clone)]
pub struct EventDerivative {
    /// [s]
    pub t: f64,
    /// Descriptions of the guards.
    pub what: Vec<&'static str>,
    pub from: ContactMode,
    pub to: ContactMode,
    /// Supporting leg after the event.
    pub leg: Leg,
    /// Rate of the guard at the event, per second; None for an event at a fixed time.
    pub guard_rate: Option<f64>,
    /// State after the event per state before it, both at the time of the event.
    pub saltation: DMatrix<f64>,
    /// Derivatives of the time by the start state, the held torques and the parameters [s per unit].
    pub dt_dx: DVector<f64>,
    pub dt_du: DVector<f64>,
    pub dt_dp: DVector<f64>,
}

/// The records of one event.
#[derive(Debug, Clone)]
pub struct EventGroup<'a> {
    /// Index of the first record.
    pub index: usize,
    pub records: &'a [Record],
    /// The step that located it; None for an event at a fixed time.
    pub step: Option<&'a StepRecord>,
    pub first: (Guard, f64, &'a State),
    /// State after it.
    pub after: &'a State,
}

/// The events of a motion; those of one instant form one group.
pub fn groups(records: &[Record]) -> Vec<EventGroup<'_>> {
    let mut groups = Vec::new();
    let (mut step, mut start) = (None, 0);
    loop {
        let end = records[start..]
            .iter()
            .position(|r| matches!(r, Record::Step(_)));
        let end = end.map_or(records.len(), |at| start + at);
        let instant = &records[start..end];
        let first = instant.iter().position(|r| matches!(r, Record::Event(..)));
        let last = instant
            .iter()
            .rposition(|r| matches!(r, Record::EventEnds(..)));
        if let (Some(first), Some(last)) = (first, last)
            && let (Record::Event(guard, value, before), Record::EventEnds(after, _)) =
                (&instant[first], &instant[last])
        {
            let located = |step: &&StepRecord| matches!(step.end, StepEnd::Guard(_));
            groups.push(EventGroup {
                index: start + first,
                records: &instant[first..=last],
                step: step.filter(located),
                first: (*guard, *value, before),
                after,
            });
        }
        match records.get(end) {
            Some(Record::Step(record)) => (step, start) = (Some(&**record), end + 1),
            _ => return groups,
        }
    }
}

impl EventGroup<'_> {
    /// Descriptions of its guards.
    pub fn what(&self) -> Vec<&'static str> {
        let guards = self.records.iter().filter_map(|record| match record {
            Record::Event(guard, ..) => Some(guard.describe()),
            _ => None,
        });
        guards.collect()
    }

    /// Saltation matrix and the guard's rate; `residual` are the torques held before the event.
    pub fn saltation(
        &self,
        model: &Model,
        method: Method,
        residual: &[f64; NV],
    ) -> (DMatrix<f64>, Option<f64>) {
        let size = state_size(model.n);
        let mut done = (DMatrix::zeros(size, size), None);
        Width::widest().run(Pass {
            group: self,
            model,
            method,
            residual,
            done: &mut done,
        });
        done
    }
}

struct Pass<'a, 'b> {
    group: &'a EventGroup<'b>,
    model: &'a Model,
    method: Method,
    residual: &'a [f64; NV],
    done: &'a mut (DMatrix<f64>, Option<f64>),
}

impl SimdTask for Pass<'_, '_> {
    fn run_scalar(self) {
        self.run_simd::<f64>();
    }

    fn run_simd<R: Register>(self) {
        let (model, group) = (self.model, self.group);
        let (n, size) = (model.n, state_size(model.n));
        let (guard, _, before) = group.first;
        let start = (before, self.residual);
        let varied = Varied {
            model,
            parameters: &Parameters::default(),
        };
        let mut replay = Replay::<R>::new(varied, self.method, start, size);
        replay.enter_state(before);
        let mut shifts = vec![R::zero(); replay.all.len()];
        if group.step.is_some() {
            let context = StepContext::of(model, before, self.residual);
            let slope = replay.accelerations_at(&context);
            let mut along = Variation::<R>::of(before, self.residual);
            for c in 0..n {
                along.q[c].d = R::of(before.v[c]);
                along.v[c].d = R::of(slope[c]);
            }
            along.t.d = R::one();
            replay.set_guard(guard, &context);
            let rate = replay.guard_at(&context, &along).lane(0);
            self.done.1 = Some(rate);
            for (i, shift) in shifts.iter_mut().enumerate() {
                let state = replay.all[i].state.clone();
                *shift = -replay.guard_at(&context, &state) * R::of(1.0 / rate);
                let state = &mut replay.all[i].state;
                for c in 0..n {
                    state.q[c].d += R::of(before.v[c]) * *shift;
                    state.v[c].d += R::of(slope[c]) * *shift;
                }
                state.t.d = *shift;
            }
        }
        for record in group.records {
            replay.apply(record);
        }
        let residual = replay.all[0].state.residual.map(|tau| tau.x);
        let context = StepContext::of(model, group.after, &residual);
        for directions in &mut replay.all {
            directions.state.set_values(group.after);
        }
        let slope = replay.accelerations_at(&context);
        for (i, shift) in shifts.into_iter().enumerate() {
            let state = &mut replay.all[i].state;
            for c in 0..n {
                state.q[c].d -= R::of(group.after.v[c]) * shift;
                state.v[c].d -= R::of(slope[c]) * shift;
            }
        }
        replay.leave_state(group.after.mode);
        for directions in &mut replay.all {
            directions.write(n, &mut self.done.0);
        }
    }
}
