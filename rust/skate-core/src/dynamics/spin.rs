//! Angular momentum of the robot with its root at rest, and its moment of inertia, about O in the sagittal plane.
//!
//! Legs and trunk in world axes, limbs in the frame of their carrier.

use crate::{
    dynamics::kinematics::Kinematics,
    model::{
        lanes::ModelLanes,
        layout::{NB, NV, coordinate},
    },
    numeric::{scalar::Scalar, spatial::at, vec3},
};
use nalgebra::{Matrix3, Vector3};

/// See the module's documentation.
#[derive(Debug, Clone, Copy)]
pub struct Spin<T> {
    /// [kg m2/s]
    pub momentum: T,
    /// [kg m2]
    pub inertia: T,
}

/// Velocity of a joint, and angular velocity about x of the body that it carries.
#[derive(Debug, Clone, Copy)]
struct JointMotion<T> {
    w: T,
    v: [T; 2],
}

impl<T: Scalar> JointMotion<T> {
    #[inline(always)]
    fn at_rest() -> Self {
        Self {
            w: T::zero(),
            v: [T::zero(); 2],
        }
    }

    /// Of a point of the body at `r` from the joint.
    #[inline(always)]
    fn at(&self, r: [T; 2]) -> Self {
        let w = self.w;
        Self {
            w,
            v: [self.v[0] - w * r[1], self.v[1] + w * r[0]],
        }
    }
}

/// Bodies at rest in one frame, about its origin.
#[derive(Debug, Clone, Copy)]
struct Part<T: Scalar> {
    mass: T,
    /// Mass times position.
    moment: Vector3<T>,
    /// Moments of inertia; only the upper triangle is used.
    J: [[T; 3]; 3],
}

/// The limbs, with their motion relative to their carrier, about its joint in its frame.
#[derive(Debug, Clone, Copy)]
struct Limbs<T: Scalar> {
    part: Part<T>,
    /// Momentum along y and z.
    momentum: [T; 2],
    /// Angular momentum.
    spin: Vector3<T>,
}

impl<T: Scalar> Spin<T> {
    #[inline(always)]
    pub fn zero() -> Self {
        Self {
            momentum: T::zero(),
            inertia: T::zero(),
        }
    }

    /// From `Kinematics::frames` and the joints' rates.
    #[inline(always)]
    pub fn about_origin(models: impl ModelLanes<T>, kin: &Kinematics<T>, v: &[T; NV]) -> Self {
        let model = models.shape();
        let mut sum = Self::zero();
        let n_planar = model.n_planar.min(NB);
        let mut joints = [JointMotion::at_rest(); NB];
        for b in 0..n_planar {
            let (up, p, c, body) = (model.parent[b], kin.joint[b], kin.c[b], models.body(b));
            if b > 0 {
                let from = kin.joint[up];
                joints[b] = joints[up].at([p[0] - from[0], p[1] - from[1]]);
                joints[b].w += v[coordinate(b)];
            }
            let centre = joints[b].at([c[0] - p[0], c[1] - p[1]]);
            sum.add(body.mass, c, centre.v);
            sum.momentum += body.across * centre.w;
            sum.inertia += body.across;
        }
        if model.carrier.is_some() {
            sum.add_trunk(models, kin, v, joints[model.parent[n_planar]]);
        }
        sum
    }

    /// Add a mass at `r` with the velocity `v`.
    #[inline(always)]
    fn add(&mut self, mass: T, r: [T; 2], v: [T; 2]) {
        self.momentum += mass * (r[0] * v[1] - r[1] * v[0]);
        self.inertia += mass * (r[0] * r[0] + r[1] * r[1]);
    }

    /// Add the bodies above the waist; `base` is the motion of the waist.
    #[inline(always)]
    fn add_trunk(
        &mut self,
        models: impl ModelLanes<T>,
        kin: &Kinematics<T>,
        v: &[T; NV],
        base: JointMotion<T>,
    ) {
        let model = models.shape();
        let first = model.n_planar.min(NB);
        let carrier = (first + model.n_trunk - 1).min(NB - 1);
        let mut p = kin.p[model.parent[first]];
        let mut w = Vector3::new(base.w, T::zero(), T::zero());
        let mut u = Vector3::new(T::zero(), base.v[0], base.v[1]);
        for b in first..=carrier {
            let from = std::mem::replace(&mut p, kin.p[b]);
            u = vec3::add(&u, &vec3::cross(&w, &vec3::sub(&p, &from)));
            w = vec3::add(&w, &vec3::scale(&kin.axis[b], v[coordinate(b)]));
            let (R, mut part) = (&kin.R[b], Part::of_trunk(models, b));
            if b == carrier {
                let limbs = Limbs::of(models, kin, v, carrier);
                part.add(&limbs.part);
                self.momentum += vec3::apply(R, &limbs.spin).x;
                let [y, z] = limbs.momentum;
                let own = vec3::apply(R, &Vector3::new(T::zero(), y, z));
                self.momentum += p.y * own.z - p.z * own.y;
            }
            self.add_part(&part, R, [&p, &u, &w]);
        }
    }

    /// Add a part whose frame, turned by `R`, has its origin at `p`, which moves at `u`, and rotates at `w`.
    #[inline(always)]
    fn add_part(&mut self, part: &Part<T>, R: &Matrix3<T>, [p, u, w]: [&Vector3<T>; 3]) {
        let x = Vector3::new(R[(0, 0)], R[(0, 1)], R[(0, 2)]);
        let mut about_x = vec3::zero();
        for i in 0..3 {
            about_x[i] =
                at(&part.J, i, 0) * x.x + at(&part.J, i, 1) * x.y + at(&part.J, i, 2) * x.z;
        }
        self.momentum += vec3::dot(&about_x, &vec3::apply_transposed(R, w));
        self.inertia += vec3::dot(&about_x, &x);
        // From the frame's origin to O.
        let arm = vec3::apply(R, &part.moment);
        let moves = vec3::cross(w, &arm);
        self.add(part.mass, [p.y, p.z], [u.y, u.z]);
        self.momentum += arm.y * u.z - arm.z * u.y + p.y * moves.z - p.z * moves.y;
        self.inertia += T::of(2.0) * (p.y * arm.y + p.z * arm.z);
    }
}

impl<T: Scalar> Part<T> {
    #[inline(always)]
    fn zero() -> Self {
        Self {
            mass: T::zero(),
            moment: vec3::zero(),
            J: [[T::zero(); 3]; 3],
        }
    }

    /// A body of the trunk.
    #[inline(always)]
    fn of_trunk(models: impl ModelLanes<T>, b: usize) -> Self {
        let body = models.body(b);
        Self {
            mass: body.mass,
            moment: Vector3::from(body.com.map(|x| body.mass * x)),
            J: models.trunk(b - models.shape().n_planar).n,
        }
    }

    #[inline(always)]
    fn add(&mut self, other: &Self) {
        self.mass += other.mass;
        self.moment = vec3::add(&self.moment, &other.moment);
        for i in 0..3 {
            for j in i..3 {
                self.J[i][j] += other.J[i][j];
            }
        }
    }
}

impl<T: Scalar> Limbs<T> {
    #[inline(always)]
    fn zero() -> Self {
        Self {
            part: Part::zero(),
            momentum: [T::zero(); 2],
            spin: vec3::zero(),
        }
    }

    /// Each limb by itself: sums over both arms are then symmetric.
    #[inline(always)]
    fn of(models: impl ModelLanes<T>, kin: &Kinematics<T>, v: &[T; NV], carrier: usize) -> Self {
        let model = models.shape();
        let (mut limbs, mut limb) = (Self::zero(), Self::zero());
        let (mut joint, mut from) = (JointMotion::at_rest(), [T::zero(); 2]);
        let end = model.bodies.len().min(NB);
        for b in carrier + 1..end {
            let p = kin.joint[b];
            joint = match model.parent[b] == carrier {
                true => JointMotion::at_rest(),
                false => joint.at([p[0] - from[0], p[1] - from[1]]),
            };
            from = p;
            joint.w += v[coordinate(b)];
            limb.add_rod(models, kin, b, joint);
            if b + 1 == end || model.parent[b + 1] == carrier {
                limbs.part.add(&limb.part);
                limbs.spin = vec3::add(&limbs.spin, &limb.spin);
                for i in 0..2 {
                    limbs.momentum[i] += limb.momentum[i];
                }
                limb = Self::zero();
            }
        }
        limbs
    }

    /// Add the body `b`, a rod along (0, -s, c).
    #[inline(always)]
    fn add_rod(
        &mut self,
        models: impl ModelLanes<T>,
        kin: &Kinematics<T>,
        b: usize,
        joint: JointMotion<T>,
    ) {
        let (body, p, [y, z], (s, c)) = (models.body(b), kin.joint[b], kin.c[b], kin.sin_cos[b]);
        let (x, across) = (body.side, body.across);
        let [vy, vz] = joint.at([y - p[0], z - p[1]]).v.map(|v| body.mass * v);
        let turning = y * vz - z * vy + across * joint.w;
        self.momentum = [self.momentum[0] + vy, self.momentum[1] + vz];
        self.spin = vec3::add(&self.spin, &Vector3::new(turning, -(x * vz), x * vy));
        let [mx, my, mz] = [x, y, z].map(|r| body.mass * r);
        let (xx, yy, zz) = (mx * x, my * y, mz * z);
        let more = body.along - across;
        let (to_y, to_z) = (more * s, more * c);
        self.part.add(&Part {
            mass: body.mass,
            moment: Vector3::new(mx, my, mz),
            J: [
                [yy + zz + across, -(mx * y), -(mx * z)],
                [T::zero(), xx + zz + across + to_y * s, -(my * z + to_y * c)],
                [T::zero(), T::zero(), xx + yy + across + to_z * c],
            ],
        });
    }
}
