//! The same motion under other names: swap of the legs, and the pivot moved along the sole.
//!
//! Neither changes where anything is or how it moves, so energy and momentum stay as they are, and
//! doing either twice is the identity.

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

/// Let the free foot become the supporting one. `support` and `free` are the feet's contacts under
/// their new names.
pub fn swap(model: &Model, eval: &mut Evaluation, state: &mut State, support: Foot, free: Foot) {
    eval.move_legs(model, state.mode, &state.q, &state.v);
    let kin = &eval.kin;
    let along = if support.touch == SoleContact::Heel {
        model.sole.heel
    } else {
        model.sole.toe
    };
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

/// Let the supporting foot turn about the end that `touch` names, or about the toe.
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
