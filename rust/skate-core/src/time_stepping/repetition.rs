//! A recorded step on numbers with derivatives.

use crate::{
    events::trace::TimeStepRecord,
    model::{lanes::ModelLanes, layout::NV},
    numeric::scalar::Scalar,
    rhs::{Evaluation, Stance, sole_points::SolePoints},
    time_stepping::{
        midpoint_input,
        step::{MoreauStep, Motion, moreau_step},
        step_contacts::{ModeConstraint, StepContacts},
    },
};

/// What a step depends on.
#[derive(Debug, Clone)]
pub struct StepInputs<T> {
    pub q: [T; NV],
    pub v: [T; NV],
    pub anchor: T,
    /// [s]
    pub h: T,
    /// Residual torques [N m].
    pub residual: [T; NV],
}

/// Result of a step.
#[derive(Debug, Clone)]
pub struct StepResult<T> {
    pub q: [T; NV],
    pub v: [T; NV],
    pub anchor: T,
    pub sole_points: SolePoints<T>,
}

/// Repeat a recorded step from `inputs`, with the contact mode in which it has ended. None where the constraints
/// depend on each other.
#[inline(always)]
pub fn repeat<T: Scalar, R: ModelLanes<T>>(
    models: R,
    (record, stance): (&TimeStepRecord, &Stance<T>),
    inputs: StepInputs<T>,
    eval: &mut Evaluation<T>,
) -> Option<StepResult<T>> {
    let (start, end) = (&record.start, record.after.mode);
    let mut step = MoreauStep {
        start: Motion {
            q: inputs.q,
            v: inputs.v,
            anchor: inputs.anchor,
            energies: [T::zero(); 3],
        },
        h: inputs.h,
        residual: inputs.residual,
        ..MoreauStep::default()
    };
    let constraint = ModeConstraint {
        near: end,
        fixed: true,
    };
    let (starts, constraints) = ([start.mode], [constraint]);
    let mut contacts = StepContacts::ending_in(models, &starts, &constraints, &[end]);
    let now = [midpoint_input(start, record.h)];
    let done = moreau_step(eval, &mut contacts, &mut step, stance, &now);
    (done && contacts.outcome(0) == Ok(end)).then_some(StepResult {
        q: step.end.q,
        v: step.end.v,
        anchor: step.end.anchor,
        sole_points: step.sole_points,
    })
}
