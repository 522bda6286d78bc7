//! Visual lifting, Eqs. 14 and 15: a force pulls the head towards a point above and ahead of the supporting ankle.

use crate::{
    control::head::HeadInput,
    model::{controller_terms::Term, lanes::ModelLanes},
    numeric::{scalar::Scalar, vec3},
    scene::Lifting,
};
use nalgebra::Vector3;

#[inline(always)]
fn number<T: Scalar>(models: impl ModelLanes<T>, i: usize, of: fn(&Lifting) -> f64) -> T {
    models.number(|m| match &m.controller_terms[i] {
        Term::Lifting(law) => of(law),
        _ => 0.0,
    })
}

/// K_p of term `i`: the slope of its force [N/m].
#[inline(always)]
pub fn stiffness<T: Scalar>(models: impl ModelLanes<T>, i: usize) -> Vector3<T> {
    Vector3::new(
        number(models, i, |law| law.K_p[0]),
        number(models, i, |law| law.K_p[1]),
        number(models, i, |law| law.K_p[2]),
    )
}

/// Force K_p (psi_d - psi) of term `i`. The target height is measured from the ice, not from the pivot.
#[inline(always)]
pub fn force<T: Scalar>(
    models: impl ModelLanes<T>,
    i: usize,
    input: &HeadInput<'_, T>,
) -> Vector3<T> {
    let ahead = number(models, i, |law| law.ahead);
    let height = number(models, i, |law| law.height);
    let ankle = input.kin.p[input.leg[0]];
    let target = Vector3::new(T::zero(), ankle.y + ahead, height - input.z0);
    vec3::mul(&stiffness(models, i), &vec3::sub(&target, &input.head))
}
