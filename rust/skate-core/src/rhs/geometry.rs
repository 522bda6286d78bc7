//! Kinematics of a configuration, as far as a caller needs them.

use crate::{
    model::{
        Model,
        contact_mode::{ContactMode, End, FREE, SoleContact},
        lanes::ModelLanes,
        layout::{FREE_FOOT, NV},
    },
    numeric::{
        scalar::{Mask, Scalar},
        simd::with_avx2,
    },
    rhs::{Evaluation, Stance, ankle_to_point, pivot_to_ankle, sole_points::support_gaps},
};
use nalgebra::Vector3;

impl<T: Scalar> Evaluation<T> {
    /// Poses and velocities of all bodies except the arms.
    #[inline(always)]
    pub fn update_kinematics(
        &mut self,
        models: impl ModelLanes<T>,
        stance: &Stance<T>,
        q: &[T; NV],
        v: &[T; NV],
    ) {
        self.kin.pivot_to_ankle = stance.pivot_to_ankle;
        self.kin.frames(models, q);
        self.kin.planar_velocities(models.shape(), v);
        if stance.rows > 0 {
            self.update_contact_point(models, stance.ankle_to_point);
        }
    }

    /// Poses of the legs; `Kinematics::trunk_and_limbs` completes them.
    #[inline(always)]
    pub fn update_leg_kinematics(
        &mut self,
        models: impl ModelLanes<T>,
        stance: &Stance<T>,
        q: &[T; NV],
    ) {
        self.kin.pivot_to_ankle = stance.pivot_to_ankle;
        self.kin.legs(models, q);
        if stance.rows > 0 {
            self.point = self.kin.sole_point(models, stance.ankle_to_point);
        }
    }

    /// Position and velocity of the free foot's contact point, `along` in front of its ankle.
    #[inline(always)]
    pub fn update_contact_point(&mut self, models: impl ModelLanes<T>, along: T) {
        self.point = self.kin.sole_point(models, along);
        let point = Vector3::new(T::zero(), self.point.y, self.point.z);
        let velocity = self.kin.point_velocity(FREE_FOOT, &point);
        self.point_velocity = [velocity.y, velocity.z, self.kin.w[FREE_FOOT].x];
    }

    /// Height above the ice of an end of a sole [m].
    #[inline(always)]
    pub fn gap(
        &self,
        models: impl ModelLanes<T>,
        support: SoleContact,
        z0: T,
        (foot, end): (usize, End),
    ) -> T {
        if foot == FREE {
            let along = models.number(|m| m.sole.ahead_of_ankle(end));
            return z0 + self.kin.sole_point(models, along).z;
        }
        let on_heel = T::Mask::of(support.pivot() == End::Heel);
        support_gaps(models, &self.kin, on_heel, z0)[end as usize]
    }
}

impl Evaluation {
    /// Poses and velocities of all bodies.
    pub fn set_configuration(
        &mut self,
        model: &Model,
        support: SoleContact,
        q: &[f64; NV],
        v: &[f64; NV],
    ) {
        self.kin.pivot_to_ankle = pivot_to_ankle(model, support);
        self.kin.positions(model, q);
        self.kin.velocities(model, v);
    }

    /// Poses and velocities of all bodies except the arms, and the free foot's contact point. The factor of M
    /// does not change.
    pub fn set_planar_configuration(
        &mut self,
        model: &Model,
        mode: ContactMode,
        q: &[f64; NV],
        v: &[f64; NV],
    ) {
        with_avx2(
            #[inline(always)]
            || self.update_kinematics(model, &Stance::of(model, mode), q, v),
        );
        if mode.free.touch == SoleContact::Air {
            self.update_contact_point(model, ankle_to_point(model, SoleContact::Air));
        }
    }

    /// Poses and velocities of the legs, and the free foot's contact point.
    pub fn set_leg_configuration(
        &mut self,
        model: &Model,
        mode: ContactMode,
        q: &[f64; NV],
        v: &[f64; NV],
    ) {
        with_avx2(
            #[inline(always)]
            || self.update_leg_kinematics(model, &Stance::of(model, mode), q),
        );
        self.set_velocities(model, mode, v);
    }

    /// Velocities of the planar bodies and of the free foot's contact point, poses unchanged.
    pub fn set_velocities(&mut self, model: &Model, mode: ContactMode, v: &[f64; NV]) {
        self.kin.planar_velocities(model, v);
        self.update_contact_point(model, ankle_to_point(model, mode.free.touch));
    }

    /// Poses, velocities and inertias of all bodies: what M, bias forces and momentum need.
    pub fn full_kinematics(
        &mut self,
        model: &Model,
        support: SoleContact,
        q: &[f64; NV],
        v: &[f64; NV],
    ) {
        self.set_configuration(model, support, q, v);
        self.inertias.update(model, &self.kin);
    }
}
