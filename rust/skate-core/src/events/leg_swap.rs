//! Changes of coordinates: the swap of the legs, and a move of the pivot along the sole.
//!
//! Neither changes the physical state, so energy and momentum are conserved, and applying either twice is the
//! identity.

use crate::{
    model::{
        Model,
        contact_mode::{ContactMode, Foot, SoleContact},
        layout::{FREE_FOOT, reverse_legs},
        state::State,
    },
    numeric::elementary,
    rhs::{Evaluation, pivot_to_ankle},
};
use nalgebra::Vector3;

/// The free foot becomes the supporting foot. `support` and `free` are the modes of the feet in their new roles.
pub fn swap(model: &Model, eval: &mut Evaluation, state: &mut State, support: Foot, free: Foot) {
    eval.set_leg_configuration(model, state.mode, &state.q, &state.v);
    let kin = &eval.kin;
    let along = model.sole.ahead_of_ankle(support.touch.pivot());
    let at = kin.sole_point(model, along);
    let velocity = kin.point_velocity(FREE_FOOT, &Vector3::new(0.0, at.y, at.z));
    let (angle, rate) = (kin.angle[FREE_FOOT], kin.w[FREE_FOOT].x);
    let (q, v) = (&mut state.q, &mut state.v);
    (q[0], q[1]) = (q[0] + at.y, q[1] + at.z);
    (v[0], v[1]) = (velocity.y, velocity.z);
    (q[2], v[2]) = (angle, rate);
    reverse_legs(q);
    reverse_legs(v);
    state.support_leg = state.support_leg.other();
    state.mode = ContactMode { support, free };
}

/// Move the pivot of the supporting foot to that of the contact `touch`.
pub fn move_pivot(model: &Model, state: &mut State, touch: SoleContact) {
    let from = pivot_to_ankle(model, state.mode.support.touch);
    let to = pivot_to_ankle(model, touch);
    let along = from[0] - to[0];
    if along != 0.0 {
        let (s, c) = elementary::sin_cos(state.q[2]);
        state.q[0] += along * c;
        state.q[1] += along * s;
        state.v[0] -= along * s * state.v[2];
        state.v[1] += along * c * state.v[2];
    }
    state.mode.support.touch = touch;
}
