//! Force on the head against its velocity relative to the supporting ankle; see `scene::Stabilizers::head_damping`.

use crate::{
    control::head::HeadInput,
    model::{controller_terms::Term, lanes::ModelLanes},
    numeric::{scalar::Scalar, vec3},
    scene::HeadDamping,
};
use nalgebra::Vector3;

/// Damping of term `i` along x, y and z: the slope of its force [N s/m].
#[inline(always)]
pub fn damping<T: Scalar>(models: impl ModelLanes<T>, i: usize) -> Vector3<T> {
    let number = |of: fn(&HeadDamping) -> f64| {
        models.number(|m| match &m.controller_terms[i] {
            Term::HeadDamping(law) => of(law),
            _ => 0.0,
        })
    };
    Vector3::new(T::zero(), number(|law| law.y), number(|law| law.z))
}

/// Force of term `i`. Needs `Kinematics::head_velocities`.
#[inline(always)]
pub fn force<T: Scalar>(
    models: impl ModelLanes<T>,
    i: usize,
    input: &HeadInput<'_, T>,
) -> Vector3<T> {
    let (kin, ankle) = (input.kin, input.leg[0]);
    let ankle = kin.point_velocity(ankle, &kin.p[ankle]);
    let head = kin.point_velocity(models.shape().head.0, &input.head);
    let (velocity, D) = (vec3::sub(&head, &ankle), damping(models, i));
    Vector3::new(T::zero(), -D.y * velocity.y, -D.z * velocity.z)
}
