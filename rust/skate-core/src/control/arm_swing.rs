//! Yaw torque tau8 that swings the arms, Eq. 22.

use crate::{
    control::OpenLoop,
    model::{controller_terms::Term, lanes::ModelLanes},
    numeric::{scalar::Scalar, trig::sin_cos_of},
};

/// Eq. 22, whose t_e is t0, by term `i`.
#[inline(always)]
pub fn torque<T: Scalar>(models: impl ModelLanes<T>, i: usize, input: &OpenLoop<T>) -> T {
    let amplitude = models.number(|m| match &m.controller_terms[i] {
        Term::ArmSwing { amplitude, .. } => *amplitude,
        _ => 0.0,
    });
    T::of(input.leg.sign()) * amplitude * sine(input.angle(0))
}

/// Inlined, it would be computed before the loop over the terms, and so without this term, too.
#[inline(never)]
fn sine<T: Scalar>(angle: T) -> T {
    sin_cos_of(angle).0
}
