//! Torques of the controller on joints of the legs, and their slopes for implicit methods.

use crate::{
    control::{
        ControllerInput, free_knee_pd, hip_pd,
        joint::{HIP, JointInput, JointTorque},
        knee_stop,
    },
    dynamics::kinematics::Kinematics,
    model::{
        controller_terms::Term,
        lanes::ModelLanes,
        layout::{LEG, NV, ROOT, WAIST},
    },
    numeric::scalar::Scalar,
};
use std::ops::Range;

/// Coordinates of all joints of the legs, in which implicit methods are implicit.
pub const IMPLICIT: Range<usize> = ROOT..LEG;

/// Call `add` with each torque of the `i`-th term. Needs `Kinematics::planar_velocities`.
#[inline(always)]
pub fn each_torque<T: Scalar>(
    input: &JointInput<'_, T>,
    models: impl ModelLanes<T>,
    (i, term): (usize, &Term),
    kin: &Kinematics<T>,
    add: impl FnMut(JointTorque<T>),
) {
    match term {
        // Torques that depend on time only, and forces on the head.
        Term::Feedforward(_) | Term::ArmSwing { .. } => {}
        Term::Lifting(_) | Term::HeadDamping(_) => {}
        Term::HipPd(_) => hip_pd::torque(models, i, kin, add),
        Term::FreeKneePd(_) => free_knee_pd::torque(models, i, input, add),
        Term::KneeStop(_) => knee_stop::torques(models, i, input, add),
    }
}

/// Slopes for methods that are implicit in them, by present coordinate.
#[derive(Debug, Clone)]
pub struct Slopes<T> {
    pub stiffness: [T; NV],
    damping: [T; NV],
    /// Coordinate of the hip, rate of the waist's pitch [rad/s], and the sense of the pitch in that coordinate.
    hip: usize,
    pitch_rate: T,
    pitch_sign: T,
}

impl<T: Scalar> Slopes<T> {
    /// At an evaluation; None if the controller has no such torques. A negative stiffness is left out: the methods
    /// are explicit in it.
    #[inline(always)]
    pub fn of(
        models: impl ModelLanes<T>,
        kin: &Kinematics<T>,
        (q, v): (&[T; NV], &[T; NV]),
        now: &[ControllerInput],
    ) -> Option<Self> {
        if !models.shape().has_joint_torques {
            return None;
        }
        let input = JointInput { q, v, now };
        let mut all = Slopes {
            stiffness: [T::zero(); NV],
            damping: [T::zero(); NV],
            hip: input.coordinate(HIP),
            pitch_rate: kin.w[WAIST].x,
            pitch_sign: T::of(if now[0].mirrored { -1.0 } else { 1.0 }),
        };
        for (i, term) in models.shape().controller_terms.iter().enumerate() {
            each_torque(
                &input,
                models,
                (i, term),
                kin,
                #[inline(always)]
                |torque| {
                    let c = input.coordinate(torque.c);
                    all.stiffness[c] += torque.stiffness.simd_max(T::zero());
                    all.damping[c] += torque.damping;
                },
            );
        }
        Some(all)
    }

    /// g D + g^2 K, with g [s].
    #[inline(always)]
    pub fn implicit_part(&self, g: T) -> [T; NV] {
        let mut part = [T::zero(); NV];
        for c in IMPLICIT {
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
        for c in IMPLICIT {
            tau[c] += T::of(0.5) * self.damping[c] * (new[c] - old[c]);
        }
        let turned = T::of(2.0) * self.pitch_sign * (kin.w[WAIST].x - self.pitch_rate);
        let rest = turned - (new[self.hip] - old[self.hip]);
        tau[self.hip] -= T::of(0.5) * half * self.stiffness[self.hip] * rest;
    }

    /// Add the torques that the matrix has applied.
    #[inline(always)]
    pub fn add_implicit_part(&self, (old, new): (&[T; NV], &[T; NV]), half: T, tau: &mut [T; NV]) {
        for c in IMPLICIT {
            let slope = T::of(0.5) * (self.damping[c] + half * self.stiffness[c]);
            tau[c] -= slope * (new[c] - old[c]);
        }
    }
}

/// Slopes of the torque on the hip by the pitch of the waist and by its rate, in the sense of the hip's coordinate.
#[derive(Debug, Clone, Copy)]
pub struct ByPitch {
    /// Coordinate of the hip.
    pub hip: usize,
    /// [N m/rad], [N m s/rad].
    pub stiffness: f64,
    pub damping: f64,
}

impl Slopes<f64> {
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
