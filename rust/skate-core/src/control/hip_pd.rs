//! Torque on the supporting hip towards a pitch of the waist; see `scene::Stabilizers::hip_pd`.
//!
//! The pitch is a sum of the angles from q1 to the hip. Time stepping is implicit in the hip's own angle and rate only.
//! The Rosenbrock method is explicit in the torque where it would drive the waist away.

use crate::{
    control::joint::{HIP, JointTorque},
    dynamics::kinematics::Kinematics,
    model::{lanes::ModelLanes, layout::WAIST},
    numeric::scalar::Scalar,
};

/// Call `add` with the torque of term `i`.
#[inline(always)]
pub fn torque<T: Scalar>(
    models: impl ModelLanes<T>,
    i: usize,
    kin: &Kinematics<T>,
    mut add: impl FnMut(JointTorque<T>),
) {
    let pitch = (kin.angle[WAIST], kin.w[WAIST].x);
    add(JointTorque::pd(models, i, HIP, pitch));
}
