//! A step that was made, once more on numbers with derivatives.

use crate::{
    dynamics::centre_of_mass::InnerMotion,
    model::{contact_mode::ContactMode, lanes::ModelLanes, layout::NV, state::State},
    numeric::scalar::Scalar,
    rhs::{Evaluation, Stance, sole_points::SolePoints},
    time_stepping::{
        midpoint_input,
        momentum::Motion,
        step::{MoreauStep, moreau_step},
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

/// Repeat the step from `start`, with the inputs' derivatives, in the contact mode `end` in which it has ended. None where
/// the constraints depend on each other.
#[inline(always)]
pub fn repeat<T: Scalar, R: ModelLanes<T>>(
    models: R,
    (start, end): (&State, ContactMode),
    stance: &Stance<T>,
    inputs: StepInputs<T>,
    eval: &mut Evaluation<T>,
) -> Option<StepResult<T>> {
    eval.update_kinematics(models, stance, &inputs.q, &inputs.v);
    let inner = InnerMotion::of(models, &eval.kin, &inputs.v, end.is_flight());
    let centre = inner.with_root(&inputs.v);
    let mut step = MoreauStep {
        start: Motion {
            q: inputs.q,
            v: inputs.v,
            anchor: inputs.anchor,
            centre,
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
    let now = [midpoint_input(start, inputs.h.lane(0))];
    let done = moreau_step(eval, &mut contacts, &mut step, stance, &now);
    (done && contacts.outcome(0) == Ok(end)).then_some(StepResult {
        q: step.end.q,
        v: step.end.v,
        anchor: step.end.anchor,
        sole_points: step.sole_points,
    })
}
