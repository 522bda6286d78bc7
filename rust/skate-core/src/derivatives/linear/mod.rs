//! Derivatives by the state and the held torques: a pass over a recorded motion along many directions, which share the
//! Jacobians of the right-hand side and the factorisations.

mod feedback;
mod flow;
mod frame_changes;
mod guards;
mod inputs;
mod jacobian;
mod loads;
mod resets;
mod step;

use crate::{
    derivatives::{
        linear::{
            flow::Inputs,
            frame_changes::{move_pivot, zero_constrained},
            step::LinearStep,
        },
        time_steps::time_step,
        variation::Variation,
    },
    events::{
        guard::Guard,
        trace::{Record, StepEnd, StepRecord, TimeStepRecord},
    },
    integrate::Method,
    model::{Model, contact_mode::ContactMode, layout::NV, state::State},
    numeric::{dual::Dual, simd::Register},
    rhs::{Evaluation, StepContext},
    sim::NY,
};

/// State with its derivatives along a register's directions.
pub struct Directions<R> {
    pub state: Variation<R>,
    /// Derivative of the right-hand side at the present state, if it is known.
    slope: Option<Box<[R; NY]>>,
    /// Derivatives of loaded slide and flight since the start, see `Totals`, and of the last change of contact.
    pub totals: [R; 3],
    /// Those of y0 and of the time at the start of the last step.
    from: [R; 2],
}

/// Directions with their workspace.
pub struct Replay<'a, R: Register> {
    model: &'a Model,
    method: Method,
    pub all: Vec<Directions<R>>,
    step: LinearStep<R>,
    /// Whether the contact constraints have been independent.
    pub regular: bool,
    /// Workspace of time stepping.
    eval: Option<Box<Evaluation<Dual<R>>>>,
}

impl<'a, R: Register> Replay<'a, R> {
    /// From a state along the unit vectors of the first `columns` entries of state and held torques.
    pub fn new(
        model: &'a Model,
        method: Method,
        (start, residual): (&State, &[f64; NV]),
        columns: usize,
    ) -> Self {
        let directions = |first: usize| {
            let mut state = Variation::of(start, residual);
            state.seed(model.n, first);
            Directions {
                state,
                slope: None,
                totals: [R::zero(); 3],
                from: [R::zero(); 2],
            }
        };
        Self {
            model,
            method,
            all: (0..columns).step_by(R::LANES).map(directions).collect(),
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
            Record::Changed => {
                for directions in &mut self.all {
                    directions.totals[2] = directions.state.t.d;
                }
            }
            Record::Counted { slide, flight } => self.count([*slide, *flight]),
            record => self.reset(record),
        }
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
            self.regular &= time_step(self.model, record, eval, state);
            state.set_values(&record.after);
        }
    }

    fn reset(&mut self, record: &Record) {
        self.step.slope = None;
        let model = self.model;
        let mut states = Vec::with_capacity(self.all.len());
        for directions in &mut self.all {
            directions.slope = None;
            states.push(&mut directions.state);
        }
        let shared = &mut self.step.differentiator;
        match *record {
            Record::Project(mode) => shared.project(model, mode, &mut states),
            Record::CloseGaps { closed, projects } => {
                shared.close_gaps(model, (closed, projects), &mut states);
            }
            Record::Impact { mode, has_friction } => {
                shared.impact(model, (mode, has_friction), &mut states);
            }
            Record::PhaseBegins(i) => {
                for state in states {
                    state.times[i] = state.t;
                }
            }
            Record::Sample(before, after) => {
                for state in states {
                    if before.leg != after.leg {
                        state.times[0] = state.t;
                    }
                    state.tau7.x = after.tau7;
                }
            }
            Record::MovePivot { from, to } => move_pivot(model, (from, to), &mut states),
            Record::Swap(mode, support) => shared.swap(model, (mode, support), &mut states),
            Record::ZeroConstrained(mode) => zero_constrained(mode, &mut states),
            Record::SetAnchor(mode) => shared.set_anchor(model, mode, &mut states),
            Record::Step(_)
            | Record::Event(..)
            | Record::EventEnds(..)
            | Record::Counted { .. }
            | Record::Changed
            | Record::TimeStep(_) => {}
        }
    }

    /// One accepted step, or its part up to an event.
    fn step(&mut self, record: &StepRecord) {
        let motion = (self.model, self.method);
        self.regular &= self.step.prepare(motion, record);
        for Directions {
            state, slope, from, ..
        } in &mut self.all
        {
            state.set_values(&record.start);
            *from = [state.q[0].d, state.t.d];
            self.step.step(motion, record, (state, slope));
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
            .differentiate(self.model, context, (state.t.x, &q, &v))
    }

    /// Set the guard of `guard_at`, at the state of `accelerations_at`.
    pub fn set_guard(&mut self, guard: Guard, context: &StepContext) {
        let q = self.all[0].state.q.map(|q| q.x);
        self.step.set_guard(self.model, (guard, context), &q);
    }

    /// Derivative of the guard along a register's directions.
    pub fn guard_at(&mut self, context: &StepContext, state: &Variation<R>) -> R {
        let (q, v) = (state.q.map(|q| q.d), state.v.map(|v| v.d));
        let inputs = Inputs::of(context, state);
        self.step
            .guard_slope(self.model.n, &inputs, (state.t.d, &q, &v))
    }
}

/// Records that project onto the constraints of a mode.
pub fn projection(mode: ContactMode) -> [Record; 2] {
    [Record::ZeroConstrained(mode), Record::Project(mode)]
}
