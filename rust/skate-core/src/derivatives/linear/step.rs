//! A recorded time step from Jacobians, for derivatives by state and torques.

use crate::{
    derivatives::{
        linear::{
            flow::{Inputs, Jacobians, LinearFlow, MotionFlow},
            guards::Gradient,
            jacobian::{Differentiator, Jacobian},
        },
        parameters::Varied,
        tape::StepRecord,
        variation::Variation,
    },
    events::{guard::Guard, observer::StepEnd},
    integrate::{Method, Size, Start, System, TimeStep},
    model::layout::NV,
    numeric::{dual::Dual, simd::Register},
    rhs::{Evaluation, StepContext},
    sim::{NY, mode_system::unpack},
};

/// Workspace that all directions share.
pub struct LinearStep<R: Register> {
    pub differentiator: Box<Differentiator<R>>,
    /// Attempted steps: the motion's, and its derivative along some directions. A pass without steps has none.
    steps: Option<Box<(TimeStep<NY>, TimeStep<NY, R>)>>,
    jacobians: Jacobians,
    at_guard: Box<Jacobian>,
    /// Right-hand side at the start of the step.
    start: [f64; NY],
    /// Right-hand side at the present state, if it is known.
    pub slope: Option<[f64; NY]>,
    /// Where an event ends the step: rate of the state by the fraction of the step, and of the guard.
    event: ([f64; NY], f64),
    gradient: Gradient,
    eval: Box<Evaluation<Dual<f64>>>,
}

impl<R: Register> Default for LinearStep<R> {
    fn default() -> Self {
        Self {
            differentiator: Box::default(),
            steps: None,
            jacobians: Jacobians::default(),
            at_guard: Box::default(),
            start: [0.0; NY],
            slope: None,
            event: ([0.0; NY], 0.0),
            gradient: Gradient::default(),
            eval: Box::default(),
        }
    }
}

/// Derivatives of an integrated vector.
#[inline(always)]
fn vector<R: Register>(n: usize, state: &Variation<R>) -> [R; NY] {
    let mut y = [R::zero(); NY];
    for c in 0..n {
        (y[c], y[n + c]) = (state.q[c].d, state.v[c].d);
    }
    y
}

impl<R: Register> LinearStep<R> {
    /// The Jacobians of a step's evaluations, and at the event that ends it. False where the constraints depend on
    /// each other.
    pub fn prepare(&mut self, (varied, method): (Varied<'_>, Method), record: &StepRecord) -> bool {
        let n = varied.model.n.min(NV);
        let (t, h) = (record.start.t, record.h);
        let mut y = [0.0; NY];
        y[..n].copy_from_slice(&record.start.q[..n]);
        y[n..2 * n].copy_from_slice(&record.start.v[..n]);
        let mut steps = self.steps.take().unwrap_or_else(|| {
            let sizes = vec![Size::UNIT; 2 * n];
            Box::new((TimeStep::new(&sizes, &[]), TimeStep::new(&sizes, &[])))
        });
        let step = &mut steps.0;
        self.jacobians.clear();
        let mut flow = MotionFlow {
            differentiator: &mut self.differentiator,
            varied,
            context: &record.context,
            jacobians: &mut self.jacobians,
        };
        let mut done = Ok(());
        self.start = self.slope.take().unwrap_or_else(|| {
            let mut slope = [0.0; NY];
            done = flow.rhs(t, &y, &mut slope);
            slope
        });
        let start = Start {
            t,
            y: &y,
            slope: &self.start,
        };
        let mut done = done.and(step.attempt_explicit(method, &mut flow, start, h));
        match record.end {
            StepEnd::Length | StepEnd::Until => self.slope = Some(*step.dy1()),
            StepEnd::Guard(_) | StepEnd::Sample => {
                done = done.and(step.make_dense(method, &mut flow));
                self.event = (step.slope(record.theta), 0.0);
                y = step.at(record.theta);
            }
        }
        self.steps = Some(steps);
        if let StepEnd::Guard(guard) = record.end {
            let at = t + record.theta * h;
            let (q, v) = unpack(&y, n);
            self.differentiate(varied, &record.context, (at, q, v));
            self.set_guard(varied, (guard, &record.context), q);
            let (q, v) = unpack(&self.event.0, n);
            let along = (R::of(h), &q.map(R::of), &v.map(R::of));
            self.event.1 = self.guard_slope(n, &Inputs::default(), along).lane(0);
        }
        let regular = |jacobian: &Jacobian| jacobian.regular;
        done.is_ok() && self.jacobians.as_slice().iter().all(regular)
    }

    /// The Jacobian for guards at (t, q, v); returns the accelerations.
    pub fn differentiate(
        &mut self,
        varied: Varied<'_>,
        context: &StepContext,
        at: (f64, &[f64; NV], &[f64; NV]),
    ) -> [f64; NV] {
        self.differentiator
            .update(varied, context, at, &mut self.at_guard);
        *self.at_guard.value.first_chunk().expect("ROWS > NV")
    }

    /// Set the guard of `guard_slope`, at the state of `differentiate` with the positions `q`.
    pub fn set_guard(
        &mut self,
        varied: Varied<'_>,
        (guard, context): (Guard, &StepContext),
        q: &[f64; NV],
    ) {
        let at = (&*self.at_guard, q);
        let evals = (&mut *self.eval, &mut self.differentiator.varied);
        self.gradient = Gradient::of(varied, (guard, context.mode), at, evals);
    }

    /// Derivative of the guard by those of the time, of q and of v.
    #[inline(never)]
    pub fn guard_slope(&self, n: usize, inputs: &Inputs<R>, along: (R, &[R; NV], &[R; NV])) -> R {
        R::with_target_features(
            #[inline(always)]
            || self.gradient.along((n, &self.at_guard), inputs, along),
        )
    }

    /// The step of `prepare` along a register's directions. `slope` is the derivative of the right-hand side at the
    /// state, if it is known.
    #[inline(never)]
    pub fn step(
        &mut self,
        (n, method): (usize, Method),
        record: &StepRecord,
        (state, slope): (&mut Variation<R>, &mut Option<Box<[R; NY]>>),
    ) {
        let Some(mut steps) = self.steps.take() else {
            return;
        };
        R::with_target_features(
            #[inline(always)]
            || {
                let n = n.min(NV);
                let attempt = &mut steps.1;
                let (t, y) = (state.t.d, vector(n, state));
                let h = Dual {
                    x: record.h,
                    d: R::of(-record.share) * t,
                };
                let is_known = slope.is_some();
                let mut flow = LinearFlow {
                    n,
                    h,
                    t,
                    jacobians: self.jacobians.as_slice().iter(),
                    inputs: Inputs::of(&record.context, state),
                    slope: slope.take().unwrap_or_else(|| Box::new([R::zero(); NY])),
                };
                let mut start = [R::zero(); NY];
                if is_known {
                    flow.start(&self.start, &mut start);
                } else {
                    // `prepare` made one Jacobian for each evaluation.
                    let _ = flow.rhs(R::zero(), &y, &mut start);
                }
                let from = Start {
                    t: R::zero(),
                    y: &y,
                    slope: &start,
                };
                let _ = attempt.attempt_explicit(method, &mut flow, from, R::one());
                let (mut y, mut at) = (attempt.y1, t + h.d);
                if let StepEnd::Guard(_) | StepEnd::Sample = record.end {
                    let _ = attempt.make_dense(method, &mut flow);
                    let theta = R::of(record.theta);
                    y = attempt.at(theta);
                    at = t + theta * h.d;
                    let shift = match record.end {
                        StepEnd::Guard(_) => {
                            let (q, v) = unpack(&y, n);
                            let value = self.guard_slope(n, &flow.inputs, (at, q, v));
                            -value * R::of(1.0 / self.event.1)
                        }
                        // The time of a sample is fixed.
                        _ => -at * R::of(1.0 / h.x),
                    };
                    for (y, slope) in y.iter_mut().zip(&self.event.0) {
                        *y += R::of(*slope) * shift;
                    }
                    at += R::of(h.x) * shift;
                } else {
                    *slope = Some(flow.slope);
                }
                for c in 0..n {
                    (state.q[c].d, state.v[c].d) = (y[c], y[n + c]);
                }
                state.t.d = at;
            },
        );
        self.steps = Some(steps);
    }
}
