//! Torque on a knee that bends backward, K q (1 + c q') for q > 0; see `scene::Stabilizers::knee_stop`. The free
//! knee's angle is limited to negative values, the supporting knee's to positive ones.
//!
//! Where K (1 + c q') is negative, implicit methods are explicit in it.

use crate::{
    control::joint::{FREE_KNEE, JointInput, JointTorque, KNEE},
    model::{controller_terms::Term, lanes::ModelLanes},
    numeric::scalar::{Mask, Scalar},
    scene::KneeStop,
};

/// Both knees, with the sign of the angles that the stop limits.
const KNEES: [(usize, f64); 2] = [(KNEE, -1.0), (FREE_KNEE, 1.0)];

/// Call `add` with the torque of term `i` on each knee that bends backward in a lane.
#[inline(always)]
pub fn torques<T: Scalar>(
    models: impl ModelLanes<T>,
    i: usize,
    input: &JointInput<'_, T>,
    mut add: impl FnMut(JointTorque<T>),
) {
    let number = |of: fn(&KneeStop) -> f64| {
        models.number(|m| match &m.controller_terms[i] {
            Term::KneeStop(stop) => of(stop),
            _ => 0.0,
        })
    };
    for (c, sign) in KNEES {
        let (sign, (angle, rate)) = (T::of(sign), input.motion(c));
        let (angle, rate) = (sign * angle, sign * rate);
        let stopped = T::zero().lt(angle);
        if stopped.any() {
            let (stiffness, damping) = (number(|stop| stop.stiffness), number(|stop| stop.damping));
            let factor = T::one() + damping * rate;
            let torque = JointTorque {
                c,
                torque: -(sign * stiffness * angle * factor),
                stiffness: stiffness * factor,
                damping: stiffness * damping * angle,
            };
            add(torque.only(stopped));
        }
    }
}
