//! Derivatives of steps of time stepping: the step itself on dual numbers, a register of directions at a time.
//!
//! Contact modes are held, and so are the lengths of steps, except where a landing ends a step: its time changes so
//! that the end stays on the ice. Later steps that divide the time left, or end at a sample, have the derivative of
//! that time.

use crate::{
    derivatives::{feedforward::feedforward_torque, variation::Variation},
    events::{guard::Guard, trace::TimeStepRecord},
    model::{Model, lanes::Broadcast},
    numeric::{dual::Dual, simd::Register},
    rhs::{Evaluation, Stance},
    time_stepping::{StepInputs, StepResult, repeat},
};

/// Carry the derivatives of a state through a step. False where the constraints depend on each other.
pub fn time_step<R: Register>(
    model: &Model,
    record: &TimeStepRecord,
    eval: &mut Evaluation<Dual<R>>,
    state: &mut Variation<R>,
) -> bool {
    let mut h = Dual {
        x: record.h,
        d: R::of(-record.share) * state.t.d,
    };
    let Some(mut result) = attempt(model, record, eval, (state, h)) else {
        return false;
    };
    if let Some(Guard::Gap(which, end)) = record.landing {
        let points = &result.sole_points;
        let rate = points.speeds[which][end as usize][1].x;
        h.d -= points.gaps[which][end as usize].d / R::of(rate);
        match attempt(model, record, eval, (state, h)) {
            Some(landed) => result = landed,
            None => return false,
        }
    }
    (state.q, state.v, state.anchor) = (result.q, result.v, result.anchor);
    state.t.d += h.d;
    true
}

#[inline(never)]
fn attempt<R: Register>(
    model: &Model,
    record: &TimeStepRecord,
    eval: &mut Evaluation<Dual<R>>,
    (state, h): (&Variation<R>, Dual<R>),
) -> Option<StepResult<Dual<R>>> {
    R::with_target_features(
        #[inline(always)]
        || {
            let start = &record.start;
            let mut middle = state.clone();
            middle.t.d += R::of(0.5) * h.d;
            let at = (start, start.t + 0.5 * record.h);
            let (torque, _) = feedforward_torque(model, at, &middle);
            let mut residual = state.residual;
            for (residual, torque) in residual.iter_mut().zip(torque) {
                residual.d += torque.d;
            }
            let inputs = StepInputs {
                q: state.q,
                v: state.v,
                anchor: state.anchor,
                h,
                residual,
            };
            let stance = Stance::of(Broadcast(model), start.mode);
            repeat(Broadcast(model), (record, &stance), inputs, eval)
        },
    )
}
