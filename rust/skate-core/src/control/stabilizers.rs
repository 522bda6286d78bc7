//! Stabilizing torques that are not in the paper; see `scene::Stabilizers`.

use crate::{
    control::ControllerInput,
    dynamics::kinematics::Kinematics,
    model::{
        controller_state::Phase,
        controller_terms::Term,
        lanes::ModelLanes,
        layout::{LEG, NV, ROOT, WAIST},
    },
    numeric::scalar::{Mask, Scalar},
};

/// Coordinates of the knees and of the supporting hip.
const KNEE: usize = ROOT + 1;
const HIP: usize = ROOT + 2;
const FREE_KNEE: usize = ROOT + 4;
/// Both knees, with the sign of the angles that the knee stop limits.
const KNEES: [(usize, f64); 2] = [(KNEE, -1.0), (FREE_KNEE, 1.0)];
/// A leg joint and its mirror image have coordinates of this sum.
const MIRROR: usize = 2 * ROOT + 5;

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
    let swings = swings::<T>(now);
    if swings.any() {
        let (angle, rate) = (leg_joint(now, q, FREE_KNEE), leg_joint(now, v, FREE_KNEE));
        let torque = torque(models, i, angle, rate);
        tau[FREE_KNEE] += T::select(swings, torque, T::zero());
    }
}

/// Lanes in which the free leg swings.
#[inline(always)]
fn swings<T: Scalar>(now: &[ControllerInput]) -> T::Mask {
    T::Mask::from_lanes(|lane| now[lane].controller.phase == Some(Phase::Swing))
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
    for (c, sign) in KNEES {
        let sign = T::of(sign);
        let (angle, rate) = (sign * leg_joint(now, q, c), sign * leg_joint(now, v, c));
        let stopped = T::zero().lt(angle);
        if stopped.any() {
            let (stiffness, damping) = stop(models, i);
            let torque = sign * stiffness * angle * (T::one() + damping * rate);
            tau[c] -= T::select(stopped, torque, T::zero());
        }
    }
}

/// Slopes of the stabilizers' torques with the sign of a resistance, by coordinate.
#[derive(Debug, Clone, Copy)]
pub struct Resistance<T> {
    /// By the joint's angle [N m/rad] and rate [N m s/rad].
    pub stiffness: [T; NV],
    damping: [T; NV],
    /// Coordinate of the hip, and the rate of the waist's pitch [rad/s], on which its torque depends, in the sense of that
    /// coordinate.
    hip: usize,
    pitch_rate: T,
    pitch_sign: T,
}

impl<T: Scalar> Resistance<T> {
    /// At an evaluation.
    #[inline(always)]
    pub fn of(
        models: impl ModelLanes<T>,
        kin: &Kinematics<T>,
        (q, v): (&[T; NV], &[T; NV]),
        now: &[ControllerInput],
    ) -> Self {
        let number = |c: usize| if now[0].mirrored { MIRROR - c } else { c };
        let mut all = Resistance {
            stiffness: [T::zero(); NV],
            damping: [T::zero(); NV],
            hip: number(HIP),
            pitch_rate: kin.w[WAIST].x,
            pitch_sign: T::of(if now[0].mirrored { -1.0 } else { 1.0 }),
        };
        for (i, term) in models.shape().controller_terms.iter().enumerate() {
            match term {
                Term::HipPd(_) => {
                    let (gain, damping) = gains(models, i);
                    all.stiffness[all.hip] += gain;
                    all.damping[all.hip] += damping;
                }
                Term::FreeKneePd(_) => {
                    let (gain, damping) = gains(models, i);
                    let swings = swings::<T>(now);
                    all.stiffness[number(FREE_KNEE)] += T::select(swings, gain, T::zero());
                    all.damping[number(FREE_KNEE)] += T::select(swings, damping, T::zero());
                }
                Term::KneeStop(_) => {
                    for (c, sign) in KNEES {
                        let sign = T::of(sign);
                        let (angle, rate) =
                            (sign * leg_joint(now, q, c), sign * leg_joint(now, v, c));
                        let stopped = T::zero().lt(angle);
                        let (stiffness, damping) = stop(models, i);
                        let slope = stiffness * (T::one() + damping * rate);
                        let slope = T::select(stopped, slope.simd_max(T::zero()), T::zero());
                        all.stiffness[number(c)] += slope;
                        let slope = stiffness * damping * angle;
                        all.damping[number(c)] += T::select(stopped, slope, T::zero());
                    }
                }
                _ => {}
            }
        }
        all
    }

    /// g D + g^2 K, with g [s].
    #[inline(always)]
    pub fn implicit_part(&self, g: T) -> [T; NV] {
        let mut part = [T::zero(); NV];
        for c in ROOT..LEG {
            part[c] = g * (self.damping[c] + g * self.stiffness[c]);
        }
        part
    }

    /// The matrix applies `implicit_part` to the change of a joint's rate, from `old` to `new`. The torques, computed
    /// with the mean velocities, must contain the damping of the old rate only, and the hip's that part of the waist's
    /// turn which is not the joint's own.
    #[inline(always)]
    pub fn subtract_implicit_part(
        &self,
        (old, new): (&[T; NV], &[T; NV]),
        half: T,
        kin: &Kinematics<T>,
        tau: &mut [T; NV],
    ) {
        for c in ROOT..LEG {
            tau[c] += T::of(0.5) * self.damping[c] * (new[c] - old[c]);
        }
        let turned = T::of(2.0) * self.pitch_sign * (kin.w[WAIST].x - self.pitch_rate);
        let rest = turned - (new[self.hip] - old[self.hip]);
        tau[self.hip] -= T::of(0.5) * half * self.stiffness[self.hip] * rest;
    }

    /// Add the torques that the matrix has applied.
    #[inline(always)]
    pub fn add_implicit_part(&self, (old, new): (&[T; NV], &[T; NV]), half: T, tau: &mut [T; NV]) {
        for c in ROOT..LEG {
            let slope = T::of(0.5) * (self.damping[c] + half * self.stiffness[c]);
            tau[c] -= slope * (new[c] - old[c]);
        }
    }
}

/// Slopes of the torque on the hip by the pitch of the waist and by its rate, with the sign of a resistance.
#[derive(Debug, Clone, Copy)]
pub struct ByPitch {
    /// Coordinate of the hip.
    pub hip: usize,
    /// [N m/rad], [N m s/rad].
    pub stiffness: f64,
    pub damping: f64,
}

impl Resistance<f64> {
    /// Take the torque on the hip out, if there is one.
    pub fn take_hip(&mut self) -> Option<ByPitch> {
        let (stiffness, damping) = (self.stiffness[self.hip], self.damping[self.hip]);
        (self.stiffness[self.hip], self.damping[self.hip]) = (0.0, 0.0);
        (stiffness != 0.0 || damping != 0.0).then_some(ByPitch {
            hip: self.hip,
            stiffness: self.pitch_sign * stiffness,
            damping: self.pitch_sign * damping,
        })
    }
}

/// Angle or rate of a leg joint in the controller's numbering.
#[inline(always)]
fn leg_joint<T: Scalar>(now: &[ControllerInput], x: &[T; NV], c: usize) -> T {
    if now[0].mirrored {
        -x[MIRROR - c]
    } else {
        x[c]
    }
}

/// Stiffness and damping of the knee stop, term `i`.
#[inline(always)]
fn stop<T: Scalar>(models: impl ModelLanes<T>, i: usize) -> (T, T) {
    let number = |of: fn(&crate::scene::KneeStop) -> f64| {
        models.number(|m| match &m.controller_terms[i] {
            Term::KneeStop(stop) => of(stop),
            _ => 0.0,
        })
    };
    (number(|stop| stop.stiffness), number(|stop| stop.damping))
}

/// Gain and damping of PD control by term `i`.
#[inline(always)]
fn gains<T: Scalar>(models: impl ModelLanes<T>, i: usize) -> (T, T) {
    (
        number(models, i, |pd| pd.gain),
        number(models, i, |pd| pd.damping),
    )
}

#[inline(always)]
fn torque<T: Scalar>(models: impl ModelLanes<T>, i: usize, angle: T, rate: T) -> T {
    let (gain, damping) = gains(models, i);
    gain * (number(models, i, |pd| pd.reference) - angle) - damping * rate
}

/// A number of PD control by term `i`.
#[inline(always)]
fn number<T: Scalar>(
    models: impl ModelLanes<T>,
    i: usize,
    of: fn(&crate::scene::ProportionalDerivative) -> f64,
) -> T {
    models.number(|m| match &m.controller_terms[i] {
        Term::HipPd(pd) | Term::FreeKneePd(pd) => of(pd),
        _ => 0.0,
    })
}
