//! A torque of the controller on one joint of the legs with its slopes, derivatives by the joint's angle and rate with
//! the sign of a resistance. Those of the torque on the hip are by the pitch of the waist and by its rate.

use crate::{
    control::ControllerInput,
    model::{
        controller_terms::Term,
        lanes::ModelLanes,
        layout::{NV, ROOT, WAIST, coordinate},
    },
    numeric::scalar::Scalar,
    scene::ProportionalDerivative,
};
use std::ops::Range;

/// Coordinates of the knees and of the supporting hip, in the controller's numbering.
pub const KNEE: usize = ROOT + 1;
pub const HIP: usize = ROOT + 2;
pub const FREE_KNEE: usize = ROOT + 4;
/// Coordinates whose sum is the pitch of the waist.
pub const PITCH: Range<usize> = 2..coordinate(WAIST) + 1;

/// A torque on one joint of the legs.
#[derive(Debug, Clone, Copy)]
pub struct JointTorque<T> {
    /// Coordinate, in the controller's numbering.
    pub c: usize,
    /// [N m]
    pub torque: T,
    /// [N m/rad], [N m s/rad]
    pub stiffness: T,
    pub damping: T,
}

impl<T: Scalar> JointTorque<T> {
    /// gain (reference - angle) - damping rate, by term `i`.
    #[inline(always)]
    pub fn pd(models: impl ModelLanes<T>, i: usize, c: usize, (angle, rate): (T, T)) -> Self {
        let number = |of: fn(&ProportionalDerivative) -> f64| {
            models.number(|m| match &m.controller_terms[i] {
                Term::HipPd(pd) | Term::FreeKneePd(pd) => of(pd),
                _ => 0.0,
            })
        };
        let (stiffness, damping) = (number(|pd| pd.gain), number(|pd| pd.damping));
        Self {
            c,
            torque: stiffness * (number(|pd| pd.reference) - angle) - damping * rate,
            stiffness,
            damping,
        }
    }

    /// Zero in other lanes.
    #[inline(always)]
    pub fn only(mut self, lanes: T::Mask) -> Self {
        for x in [&mut self.torque, &mut self.stiffness, &mut self.damping] {
            *x = T::select(lanes, *x, T::zero());
        }
        self
    }
}

/// What the torques depend on.
#[derive(Debug, Clone, Copy)]
pub struct JointInput<'a, T> {
    pub q: &'a [T; NV],
    pub v: &'a [T; NV],
    /// One per lane; all or none are mirrored.
    pub now: &'a [ControllerInput],
}

impl<T: Scalar> JointInput<'_, T> {
    /// Present coordinate of a leg joint in the controller's numbering. It and its mirror image have coordinates of one
    /// sum.
    #[inline(always)]
    pub fn coordinate(&self, c: usize) -> usize {
        match self.now[0].mirrored {
            true => 2 * ROOT + 5 - c,
            false => c,
        }
    }

    /// Its angle and rate.
    #[inline(always)]
    pub fn motion(&self, c: usize) -> (T, T) {
        let at = self.coordinate(c);
        match self.now[0].mirrored {
            true => (-self.q[at], -self.v[at]),
            false => (self.q[at], self.v[at]),
        }
    }
}
