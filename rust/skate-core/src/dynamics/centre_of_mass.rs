//! The centre of mass and its velocity in the sagittal plane.
//!
//! The motion of the robot is the one that its joints make while the root is at rest, and a rigid motion of the root.
//! The root's velocities that give the robot a certain momentum therefore follow in closed form.

use crate::{
    dynamics::{kinematics::Kinematics, spin::Spin},
    model::{
        Model,
        lanes::ModelLanes,
        layout::{NB, NV, coordinate},
    },
    numeric::{scalar::Scalar, vec3},
};
use nalgebra::Vector3;

/// Position and motion of the centre of mass.
#[derive(Debug, Clone, Copy, Default)]
pub struct CentreOfMass<T = f64> {
    /// y and z from O [m].
    pub at: [T; 2],
    /// [m/s]
    pub velocity: [T; 2],
    /// Angular momentum about the centre of mass, where it was asked for [kg m2/s].
    pub spin: T,
}

impl<T: Scalar> CentreOfMass<T> {
    #[inline(always)]
    pub fn zero() -> Self {
        Self {
            at: [T::zero(); 2],
            velocity: [T::zero(); 2],
            spin: T::zero(),
        }
    }
}

/// The same while the root is at rest.
#[derive(Debug, Clone, Copy)]
pub struct InnerMotion<T> {
    pub at: [T; 2],
    velocity: [T; 2],
    /// About the centre of mass; zero where it was not asked for.
    spin: Spin<T>,
}

impl<T: Scalar> InnerMotion<T> {
    /// From `Kinematics::frames` and the joints' rates; the angular momentum only if `with_spin`.
    #[inline(always)]
    pub fn of(
        models: impl ModelLanes<T>,
        kin: &Kinematics<T>,
        v: &[T; NV],
        with_spin: bool,
    ) -> Self {
        let mass = models.number(Model::mass);
        let (moment, momentum) = first_moments(models, kin, v);
        let [at, velocity] = [moment, momentum].map(|sum| sum.map(|x| x / mass));
        let mut spin = Spin::zero();
        if with_spin {
            spin = Spin::about_origin(models, kin, v);
            spin.momentum -= at[0] * momentum[1] - at[1] * momentum[0];
            spin.inertia -= at[0] * moment[0] + at[1] * moment[1];
        }
        Self { at, velocity, spin }
    }

    /// The whole motion, with the root's velocities.
    #[inline(always)]
    pub fn with_root(&self, root: &[T; NV]) -> CentreOfMass<T> {
        let [y, z] = self.at;
        CentreOfMass {
            at: self.at,
            velocity: [
                root[0] + (self.velocity[0] - root[2] * z),
                root[1] + (self.velocity[1] + root[2] * y),
            ],
            spin: self.spin.momentum + self.spin.inertia * root[2],
        }
    }

    /// Velocity of q1 for an angular momentum.
    #[inline(always)]
    pub fn rate_for(&self, spin: T) -> T {
        (spin - self.spin.momentum) / self.spin.inertia
    }

    /// Velocities of y0 and z0 for a velocity of the centre of mass, at the `rate` of q1.
    #[inline(always)]
    pub fn speeds_for(&self, velocity: [T; 2], rate: T) -> [T; 2] {
        let [y, z] = self.at;
        [
            velocity[0] - (self.velocity[0] - rate * z),
            velocity[1] - (self.velocity[1] + rate * y),
        ]
    }
}

/// Mass times position from O, and momentum with the root at rest: the sums over all bodies of `Model::moments`, and
/// of their rates of change.
#[inline(always)]
fn first_moments<T: Scalar>(
    models: impl ModelLanes<T>,
    kin: &Kinematics<T>,
    v: &[T; NV],
) -> ([T; 2], [T; 2]) {
    let model = models.shape();
    let (zero, mass) = (T::zero(), models.number(Model::mass));
    let mut sum = kin.joint[0].map(|x| mass * x);
    let mut rate = [zero; 2];
    let n_planar = model.n_planar.min(NB);
    let mut rates = [zero; NB];
    for b in 0..n_planar {
        let mut w = zero;
        if b > 0 {
            w = rates[model.parent[b]] + v[coordinate(b)];
            rates[b] = w;
        }
        let [y, z] = [1, 2].map(|i| models.number(|m| m.moments[b][i]));
        let (s, c) = kin.sin_cos[b];
        let (y, z) = (c * y - s * z, s * y + c * z);
        sum = [sum[0] + y, sum[1] + z];
        rate = [rate[0] - w * z, rate[1] + w * y];
    }
    let Some(carrier) = model.carrier else {
        return (sum, rate);
    };
    let mut w = Vector3::new(rates[model.parent[n_planar]], zero, zero);
    let mut add = |w: &Vector3<T>, r: &Vector3<T>| {
        sum = [sum[0] + r.y, sum[1] + r.z];
        rate[0] += w.z * r.x - w.x * r.z;
        rate[1] += w.x * r.y - w.y * r.x;
    };
    for b in n_planar..=carrier.min(NB - 1) {
        w = vec3::add(&w, &vec3::scale(&kin.axis[b], v[coordinate(b)]));
        let moment = [0, 1, 2].map(|i| models.number(|m| m.moments[b][i]));
        add(&w, &vec3::apply(&kin.R[b], &Vector3::from(moment)));
    }
    // Limbs in the frame of their carrier, each by itself: sums over both arms are then symmetric.
    let (mut moments, mut own) = ([zero; 2], [zero; 2]);
    let (mut limb, mut limb_own, mut turn) = ([zero; 2], [zero; 2], zero);
    let end = model.bodies.len().min(NB);
    for b in carrier + 1..end {
        let (along, (s, c)) = (models.number(|m| m.moments[b][2]), kin.sin_cos[b]);
        let (y, z) = (-(s * along), c * along);
        turn += v[coordinate(b)];
        limb = [limb[0] + y, limb[1] + z];
        limb_own = [limb_own[0] - turn * z, limb_own[1] + turn * y];
        if b + 1 == end || model.parent[b + 1] == carrier {
            for i in 0..2 {
                moments[i] += limb[i];
                own[i] += limb_own[i];
            }
            (limb, limb_own, turn) = ([zero; 2], [zero; 2], zero);
        }
    }
    let R = &kin.R[carrier];
    let [arm, own] = [moments, own].map(|[y, z]| vec3::apply(R, &Vector3::new(zero, y, z)));
    add(&w, &arm);
    (sum, [rate[0] + own.y, rate[1] + own.z])
}
