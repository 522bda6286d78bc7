//! Derivative by a parameter of the scene: a pass over a recorded motion on dual numbers.

pub mod evaluation;
pub mod flow;
mod frame_changes;
pub mod resets;
mod varied;

pub use varied::{Stencil, Varied};

use crate::{
    derivatives::{
        dual::{
            flow::{Context, Flow},
            frame_changes::FrameChange,
            resets::Reset,
        },
        variation::Variation,
    },
    events::{
        guard::Guard,
        trace::{Record, StepEnd, StepRecord},
    },
    integrate::{Method, Size, Start, System, TimeStep},
    model::{controller_terms::Term, lanes::ModelLanes, layout::NV},
    numeric::{dual::Dual, scalar::Scalar, simd::with_avx2},
    rhs::Evaluation,
    sim::NY,
};

/// State with its derivative by a parameter, and a workspace.
pub struct DualReplay<'a> {
    models: Varied<'a>,
    method: Method,
    pub state: Variation<f64>,
    eval: Box<Evaluation<Dual<f64>>>,
    attempt: Box<TimeStep<NY, Dual<f64>>>,
    /// Whether the contact constraints have been independent.
    pub regular: bool,
}

impl<'a> DualReplay<'a> {
    pub fn new(models: Varied<'a>, method: Method, state: Variation<f64>) -> Self {
        let sizes = vec![Size::UNIT; 2 * models.model.n];
        let tau7 = state.tau7.x;
        let mut replay = Self {
            models,
            method,
            state,
            eval: Box::default(),
            attempt: Box::new(TimeStep::new(&sizes, &[])),
            regular: true,
        };
        replay.set_tau7(tau7);
        replay
    }

    /// Carry the derivative through one record.
    pub fn apply(&mut self, record: &Record) {
        match record {
            Record::Step(step) => self.step(step),
            Record::Event(_, _, state) | Record::EventEnds(state, _) => {
                self.state.set_values(state);
            }
            Record::PhaseBegins(i) => self.state.times[*i] = self.state.t,
            // What a sample sets is constant, apart from t0 and the scale of tau7.
            Record::Sample(before, after) => {
                if before.leg != after.leg {
                    self.state.times[0] = self.state.t;
                }
                self.set_tau7(after.tau7);
            }
            Record::Project(_) | Record::CloseGaps { .. } | Record::Impact { .. } => {
                let mut reset = Reset {
                    models: self.models,
                    eval: &mut self.eval,
                    state: &mut self.state,
                };
                reset.apply(record);
            }
            record => {
                let mut change = FrameChange {
                    models: self.models,
                    eval: &mut self.eval,
                    state: &mut self.state,
                };
                change.apply(record);
            }
        }
    }

    /// Set the sampled torque of Eq. 21, which is proportional to the feedforward's scale.
    fn set_tau7(&mut self, tau7: f64) {
        self.state.tau7 = Dual::of(tau7);
        let terms = &self.models.model.controller_terms;
        let law = terms.iter().position(|t| matches!(t, Term::Feedforward(_)));
        if let Some(i) = law.filter(|_| tau7 != 0.0) {
            let scale = self.models.number(|m| match &m.controller_terms[i] {
                Term::Feedforward(law) => law.scale * law.tau7_scale,
                _ => 0.0,
            });
            self.state.tau7.d = tau7 / scale.x * scale.d;
        }
    }

    /// One accepted step, or its part up to an event.
    fn step(&mut self, record: &StepRecord) {
        let (state, attempt, method) = (&mut self.state, &mut self.attempt, self.method);
        state.set_values(&record.start);
        let n = self.models.model.n.min(NV);
        let (t, mut y, mut slope) = (state.t, [Dual::default(); NY], [Dual::default(); NY]);
        y[..n].copy_from_slice(&state.q[..n]);
        y[n..2 * n].copy_from_slice(&state.v[..n]);
        let h = Dual {
            x: record.h,
            d: -record.share * t.d,
        };
        let mut flow = Flow {
            eval: &mut self.eval,
            models: self.models,
            context: Context::of(&record.context, state),
            regular: true,
        };
        let done = flow.rhs(t, &y, &mut slope);
        let done = done.and(with_avx2(
            #[inline(always)]
            || {
                let start = Start {
                    t,
                    y: &y,
                    slope: &slope,
                };
                attempt.attempt_explicit(method, &mut flow, start, h)
            },
        ));
        self.regular &= done.is_ok() && flow.regular;
        let (y, t) = if matches!(record.end, StepEnd::Length | StepEnd::Until) {
            (attempt.y1, t + h)
        } else {
            let dense = attempt.make_dense(method, &mut flow);
            self.regular &= dense.is_ok() && flow.regular;
            let mut theta = Dual::of(record.theta);
            theta.d = match record.end {
                StepEnd::Guard(guard) => {
                    theta_slope(guard, &mut flow, attempt, (t, h), record.theta)
                }
                // The time of a sample is fixed.
                _ => (-record.theta * h.d - t.d) / h.x,
            };
            (attempt.at(theta), t + theta * h)
        };
        state.q[..n].copy_from_slice(&y[..n]);
        state.v[..n].copy_from_slice(&y[n..2 * n]);
        state.t = t;
        if matches!(record.end, StepEnd::Until | StepEnd::Sample) {
            state.t.d = 0.0;
        }
        state.set_values(&record.after);
    }
}

/// Derivative of the fraction of the step at which a guard is zero, by the implicit function theorem.
fn theta_slope(
    guard: Guard,
    flow: &mut Flow<'_>,
    attempt: &TimeStep<NY, Dual<f64>>,
    (t, h): (Dual<f64>, Dual<f64>),
    theta: f64,
) -> f64 {
    let fixed = attempt.at(Dual::of(theta));
    let moving = attempt.at(Dual { x: theta, d: 1.0 });
    let at = t + Dual::of(theta) * h;
    let value = flow.guard(guard, at, &fixed);
    let mut along = fixed;
    for (along, moving) in along.iter_mut().zip(&moving) {
        along.d = moving.d - along.d;
    }
    let at = Dual { x: at.x, d: h.x };
    flow.models = Varied::constant(flow.models.model);
    flow.context = flow.context.constant();
    let rate = flow.guard(guard, at, &along);
    -(value / Dual::of(rate.d)).d
}
