//! A pass over a recorded motion along many directions, by state, held torques and parameters, which share the Jacobians
//! of the right-hand side and the factorisations.

mod balance;
mod events;
mod flow;
mod guards;
mod inputs;
mod jacobian;
mod loads;
mod point;
mod projections;
mod step;

use crate::{
    derivatives::{
        linear::{events::change_state, flow::Inputs, step::LinearStep},
        parameters::Varied,
        tape::{Record, StepRecord, TimeStepRecord},
        time_steps::time_step,
        variation::{Variation, state_size},
    },
    events::{
        guard::Guard,
        observer::{Operation, StepEnd},
    },
    integrate::Method,
    model::{
        contact_mode::{ContactMode, SoleContact},
        layout::NV,
        state::State,
    },
    numeric::{dual::Dual, simd::Register},
    rhs::{Evaluation, StepContext},
    sim::NY,
};
use nalgebra::DMatrix;
use std::ops::Range;

/// State with its derivatives along a register's directions.
pub struct Directions<R> {
    /// The first of them, and their number.
    pub columns: Range<usize>,
    pub state: Variation<R>,
    /// Derivative of the right-hand side at the present state, if it is known.
    slope: Option<Box<[R; NY]>>,
    /// Derivatives of loaded slide and flight since the start, see `Totals`, and of the last change of contact.
    pub totals: [R; 3],
    /// Those of y0 and of the time at the start of the last step.
    from: [R; 2],
}

impl<R: Register> Directions<R> {
    /// Write the derivatives of the state to the columns of the directions.
    pub fn write(&mut self, n: usize, to: &mut DMatrix<f64>) {
        for row in 0..state_size(n) {
            let d = self.state.entry(n, row).d;
            for (lane, column) in self.columns.clone().enumerate() {
                to[(row, column)] = d.lane(lane);
            }
        }
    }
}

/// Directions with their workspace.
pub struct Replay<'a, R: Register> {
    varied: Varied<'a>,
    method: Method,
    pub all: Vec<Directions<R>>,
    step: LinearStep<R>,
    /// Whether the contact constraints have been independent.
    pub regular: bool,
    /// Workspace on dual numbers.
    eval: Option<Box<Evaluation<Dual<R>>>>,
}

impl<'a, R: Register> Replay<'a, R> {
    /// From a state along the unit vectors of the first `columns` entries of state and held torques, and along every
    /// parameter.
    pub fn new(
        varied: Varied<'a>,
        method: Method,
        (start, residual): (&State, &[f64; NV]),
        columns: usize,
    ) -> Self {
        let directions = |columns: Range<usize>, state| Directions {
            columns,
            state,
            slope: None,
            totals: [R::zero(); 3],
            from: [R::zero(); 2],
        };
        let mut all = Vec::new();
        for first in (0..columns).step_by(R::LANES) {
            let mut state = Variation::of(start, residual);
            state.seed(varied.model.n, first);
            let end = columns.min(first + R::LANES);
            all.push(directions(first..end, state));
        }
        let parameters = varied.parameters.len();
        for first in (0..parameters).step_by(R::LANES) {
            let mut state = Variation::of(start, residual);
            state.parameter = Some(first);
            let end = parameters.min(first + R::LANES);
            all.push(directions(columns + first..columns + end, state));
        }
        Self {
            varied,
            method,
            all,
            step: LinearStep::default(),
            regular: true,
            eval: None,
        }
    }

    /// Carry the derivatives through one record.
    pub fn apply(&mut self, record: &Record) {
        match record {
            Record::Step(step) => self.step(step),
            Record::TimeStep(step) => self.time_step(step),
            Record::Event(_, _, state) | Record::EventEnds(state, _) => self.set_values(state),
            Record::Counted { slide, flight } => self.count([*slide, *flight]),
            Record::Operation(Operation::Changed) => {
                for directions in &mut self.all {
                    directions.totals[2] = directions.state.t.d;
                }
            }
            Record::Operation(operation) => self.reset(*operation),
        }
    }

    /// From variations of `Coordinates` to those of the state.
    pub fn enter_state(&mut self, state: &State) {
        let (from, to) = (SoleContact::Toe, state.mode.support.touch);
        self.reset(Operation::MovePivot { from, to });
        self.set_values(state);
    }

    /// The inverse of `enter_state`, in a mode.
    pub fn leave_state(&mut self, mode: ContactMode) {
        let (from, to) = (mode.support.touch, SoleContact::Toe);
        self.reset(Operation::MovePivot { from, to });
    }

    fn set_values(&mut self, state: &State) {
        for directions in &mut self.all {
            directions.state.set_values(state);
        }
    }

    /// Add the last step to some of the totals.
    fn count(&mut self, counts: [bool; 2]) {
        for Directions {
            state,
            totals,
            from,
            ..
        } in &mut self.all
        {
            let now = [state.q[0].d, state.t.d];
            for i in 0..2 {
                if counts[i] {
                    totals[i] += now[i] - from[i];
                }
            }
        }
    }

    /// One step of time stepping.
    fn time_step(&mut self, record: &TimeStepRecord) {
        let eval = self.eval.get_or_insert_default();
        for Directions { state, from, .. } in &mut self.all {
            state.set_values(&record.start);
            *from = [state.q[0].d, state.t.d];
            self.regular &= time_step(self.varied.model, record, eval, state);
            state.set_values(&record.after);
        }
    }

    fn reset(&mut self, operation: Operation) {
        self.step.slope = None;
        let varied = self.varied;
        let mut states = Vec::with_capacity(self.all.len());
        for directions in &mut self.all {
            directions.slope = None;
            states.push(&mut directions.state);
        }
        let shared = &mut self.step.differentiator;
        match operation {
            Operation::Project(mode) => shared.project(varied, mode, &mut states),
            Operation::CloseGaps { closed, projects } => {
                shared.close_gaps(varied, (closed, projects), &mut states);
            }
            Operation::PhaseBegins(i) => {
                for state in states {
                    state.times[i] = state.t;
                }
            }
            // What else a sample sets is constant.
            Operation::Sample(before, after) if before.leg != after.leg => {
                for state in states {
                    state.times[0] = state.t;
                }
            }
            Operation::MovePivot { from, to } if from.pivot() == to.pivot() => {}
            Operation::MovePivot { .. }
            | Operation::Impact { .. }
            | Operation::Swap(..)
            | Operation::ZeroConstrained(_)
            | Operation::SetAnchor(_) => {
                let evals = (&mut **self.eval.get_or_insert_default(), &mut shared.varied);
                change_state(varied, operation, evals, &mut states);
            }
            Operation::Sample(..) | Operation::Changed => {}
        }
    }

    /// One accepted step, or its part up to an event.
    fn step(&mut self, record: &StepRecord) {
        let (n, method) = (self.varied.model.n, self.method);
        self.regular &= self.step.prepare((self.varied, method), record);
        for Directions {
            state, slope, from, ..
        } in &mut self.all
        {
            state.set_values(&record.start);
            *from = [state.q[0].d, state.t.d];
            self.step.step((n, method), record, (state, slope));
            if matches!(record.end, StepEnd::Until | StepEnd::Sample) {
                state.t.d = R::zero();
            }
            state.set_values(&record.after);
        }
    }

    /// Accelerations at the present state, for `set_guard`.
    pub fn accelerations_at(&mut self, context: &StepContext) -> [f64; NV] {
        let state = &self.all[0].state;
        let (q, v) = (state.q.map(|q| q.x), state.v.map(|v| v.x));
        self.step
            .differentiate(self.varied, context, (state.t.x, &q, &v))
    }

    /// Set the guard of `guard_at`, at the state of `accelerations_at`.
    pub fn set_guard(&mut self, guard: Guard, context: &StepContext) {
        let q = self.all[0].state.q.map(|q| q.x);
        self.step.set_guard(self.varied, (guard, context), &q);
    }

    /// Derivative of the guard along a register's directions.
    pub fn guard_at(&mut self, context: &StepContext, state: &Variation<R>) -> R {
        let (q, v) = (state.q.map(|q| q.d), state.v.map(|v| v.d));
        let inputs = Inputs::of(context, state);
        self.step
            .guard_slope(self.varied.model.n, &inputs, (state.t.d, &q, &v))
    }
}

/// Records that project onto the constraints of a mode.
pub fn projection(mode: ContactMode) -> [Record; 2] {
    [Operation::ZeroConstrained(mode), Operation::Project(mode)].map(Record::Operation)
}

#[cfg(test)]
mod tests;
