//! Torques that the paper does not have; see `scene::Helpers`.

use super::{Situation, feedforward::Phase};
use crate::{
    kinematics::Kinematics,
    model::{NV, ROOT, WAIST},
    scene::{KneeStop, ProportionalDerivative as Pd},
};

/// Coordinates of the knees and of the supporting hip.
const KNEE: usize = ROOT + 1;
const HIP: usize = ROOT + 2;
const FREE_KNEE: usize = ROOT + 4;

/// Towards a pitch of the waist.
#[inline(never)]
pub fn hip_pd(pd: &Pd, kin: &Kinematics, tau: &mut [f64; NV]) {
    tau[HIP] += torque(pd, kin.angle[WAIST], kin.w[WAIST].x);
}

/// Towards an angle of the free knee, states 1 to 4.
#[inline(never)]
pub fn free_knee_pd(pd: &Pd, q: &[f64; NV], v: &[f64; NV], now: &Situation, tau: &mut [f64; NV]) {
    if now.clock.phase == Some(Phase::Swing) {
        tau[FREE_KNEE] += torque(pd, now.leg_joint(q, FREE_KNEE), now.leg_joint(v, FREE_KNEE));
    }
}

/// A knee bends one way: the free knee's angle is negative, the supporting one's positive.
#[inline(never)]
pub fn knee_stop(
    stop: &KneeStop,
    q: &[f64; NV],
    v: &[f64; NV],
    now: &Situation,
    tau: &mut [f64; NV],
) {
    for (c, sign) in [(KNEE, -1.0), (FREE_KNEE, 1.0)] {
        let (angle, rate) = (sign * now.leg_joint(q, c), sign * now.leg_joint(v, c));
        if angle > 0.0 {
            tau[c] -= sign * stop.stiffness * angle * (1.0 + stop.damping * rate);
        }
    }
}

fn torque(pd: &Pd, angle: f64, rate: f64) -> f64 {
    pd.gain * (pd.reference - angle) - pd.damping * rate
}
