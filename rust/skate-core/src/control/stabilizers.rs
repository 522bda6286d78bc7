//! Stabilizing torques that are not in the paper; see `scene::Stabilizers`.

use crate::{
    control::ControllerInput,
    dynamics::kinematics::Kinematics,
    model::{
        controller_state::Phase,
        controller_terms::Term,
        lanes::ModelLanes,
        layout::{NV, ROOT, WAIST},
    },
    numeric::scalar::{Mask, Scalar},
};

/// Coordinates of the knees and of the supporting hip.
const KNEE: usize = ROOT + 1;
const HIP: usize = ROOT + 2;
const FREE_KNEE: usize = ROOT + 4;

/// PD control of the waist's pitch, by term `i`.
#[inline(always)]
pub fn hip_pd<T: Scalar>(
    models: impl ModelLanes<T>,
    i: usize,
    kin: &Kinematics<T>,
    tau: &mut [T; NV],
) {
    tau[HIP] += torque(models, i, kin.angle[WAIST], kin.w[WAIST].x);
}

/// PD control of the free knee in states 1 to 4, by term `i`.
#[inline(always)]
pub fn free_knee_pd<T: Scalar>(
    models: impl ModelLanes<T>,
    i: usize,
    (q, v): (&[T; NV], &[T; NV]),
    now: &[ControllerInput],
    tau: &mut [T; NV],
) {
    let swings = T::Mask::from_lanes(|lane| now[lane].controller.phase == Some(Phase::Swing));
    if swings.any() {
        let (angle, rate) = (leg_joint(now, q, FREE_KNEE), leg_joint(now, v, FREE_KNEE));
        let torque = torque(models, i, angle, rate);
        tau[FREE_KNEE] += T::select(swings, torque, T::zero());
    }
}

/// Knee stop by term `i`: the free knee's angle is limited to negative values, the supporting knee's to
/// positive ones.
#[inline(always)]
pub fn knee_stop<T: Scalar>(
    models: impl ModelLanes<T>,
    i: usize,
    (q, v): (&[T; NV], &[T; NV]),
    now: &[ControllerInput],
    tau: &mut [T; NV],
) {
    for (c, sign) in [(KNEE, -1.0), (FREE_KNEE, 1.0)] {
        let sign = T::of(sign);
        let (angle, rate) = (sign * leg_joint(now, q, c), sign * leg_joint(now, v, c));
        let stopped = T::zero().lt(angle);
        if stopped.any() {
            let number = |of: fn(&crate::scene::KneeStop) -> f64| {
                models.number(|m| match &m.controller_terms[i] {
                    Term::KneeStop(stop) => of(stop),
                    _ => 0.0,
                })
            };
            let (stiffness, damping) = (number(|stop| stop.stiffness), number(|stop| stop.damping));
            let torque = sign * stiffness * angle * (T::one() + damping * rate);
            tau[c] -= T::select(stopped, torque, T::zero());
        }
    }
}

/// Angle or rate of a leg joint in the controller's numbering.
#[inline(always)]
fn leg_joint<T: Scalar>(now: &[ControllerInput], x: &[T; NV], c: usize) -> T {
    if now[0].mirrored { -x[11 - c] } else { x[c] }
}

#[inline(always)]
fn torque<T: Scalar>(models: impl ModelLanes<T>, i: usize, angle: T, rate: T) -> T {
    let number = |of: fn(&crate::scene::ProportionalDerivative) -> f64| {
        models.number(|m| match &m.controller_terms[i] {
            Term::HipPd(pd) | Term::FreeKneePd(pd) => of(pd),
            _ => 0.0,
        })
    };
    let reference = number(|pd| pd.reference);
    number(|pd| pd.gain) * (reference - angle) - number(|pd| pd.damping) * rate
}
