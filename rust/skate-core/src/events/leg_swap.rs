//! Changes of coordinates: the swap of the legs, and a move of the pivot along the sole.
//!
//! Neither changes the physical state, so energy and momentum are conserved, and applying either twice is the
//! identity.

use crate::{
    dynamics::kinematics::Kinematics,
    model::{
        Model,
        contact_mode::{ContactMode, Foot, SoleContact},
        lanes::ModelLanes,
        layout::{FREE_FOOT, NV, reverse_legs},
        state::State,
    },
    numeric::{scalar::Scalar, trig::sin_cos_of},
    rhs::{Evaluation, pivot_to_ankle},
};
use nalgebra::Vector3;

/// The free foot becomes the supporting foot. `support` and `free` are the modes of the feet in their new roles.
pub fn swap(model: &Model, eval: &mut Evaluation, state: &mut State, support: Foot, free: Foot) {
    eval.set_leg_configuration(model, state.mode, &state.q, &state.v);
    swap_coordinates(model, &eval.kin, support.touch, &mut state.q, &mut state.v);
    state.support_leg = state.support_leg.other();
    state.mode = ContactMode { support, free };
}

/// Coordinates and velocities from the free foot, of which `support` becomes the pivot. Needs the poses and velocities
/// of the legs.
#[inline(always)]
pub fn swap_coordinates<T: Scalar>(
    models: impl ModelLanes<T>,
    kin: &Kinematics<T>,
    support: SoleContact,
    q: &mut [T; NV],
    v: &mut [T; NV],
) {
    let along = models.number(|m| m.sole.ahead_of_ankle(support.pivot()));
    let at = kin.sole_point(models, along);
    let velocity = kin.point_velocity(FREE_FOOT, &Vector3::new(T::zero(), at.y, at.z));
    (q[0], q[1]) = (q[0] + at.y, q[1] + at.z);
    (v[0], v[1]) = (velocity.y, velocity.z);
    (q[2], v[2]) = (kin.angle[FREE_FOOT], kin.w[FREE_FOOT].x);
    reverse_legs(q);
    reverse_legs(v);
}

/// Move the pivot of the supporting foot to that of the contact `touch`.
pub fn move_pivot(model: &Model, state: &mut State, touch: SoleContact) {
    let from = pivot_to_ankle(model, state.mode.support.touch);
    let to = pivot_to_ankle(model, touch);
    let along = from[0] - to[0];
    if along != 0.0 {
        let turn = sin_cos_of(state.q[2]);
        translate_pivot(along, turn, &mut state.q, &mut state.v);
    }
    state.mode.support.touch = touch;
}

/// Move the pivot by `along` on the sole; sine and cosine of the angle of the foot.
#[inline(always)]
pub fn translate_pivot<T: Scalar>(along: T, (s, c): (T, T), q: &mut [T; NV], v: &mut [T; NV]) {
    q[0] += along * c;
    q[1] += along * s;
    v[0] -= along * s * v[2];
    v[1] += along * c * v[2];
}
