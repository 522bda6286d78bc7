//! Workspace of the kinematics, and the positions of the bodies. `velocities` has their velocities.
//!
//! All quantities are expressed in world axes about the pivot O of the supporting foot, so that composite
//! inertias and accumulated forces are plain sums without transforms (Featherstone 2008, sections 2.9 and
//! 6.2, in one common frame). Bodies that move in the sagittal plane keep three of the six components:
//! rotation about x, translation along y and z. A time step calls `frames`, which leaves the arms in the
//! frame of their carrier; the arms' results of `positions` and `velocities` are then those of an earlier
//! state.

use crate::{
    model::{
        Model,
        lanes::ModelLanes,
        layout::{FREE_FOOT, NB, NV, coordinate},
        rigid_body::Axis,
    },
    numeric::{scalar::Scalar, trig::sin_cos, vec3},
};
use nalgebra::{Matrix3, Vector3};
use std::ops::Range;

/// Workspace of one evaluation, for models of one structure. Every field is written before it is read,
/// except the components of planar bodies that are always zero.
#[derive(Debug, Clone, Default)]
pub struct Kinematics<T: Scalar = f64> {
    /// Vector from the pivot to the ankle of the supporting foot when the foot is flat [m]; set before
    /// `positions`.
    pub pivot_to_ankle: [T; 2],
    /// Angle [rad] of a planar body to the world, of a trunk body to its parent, of a limb body to the
    /// limb's carrier.
    pub angle: [T; NB],
    /// Sine and cosine of `angle`.
    pub sin_cos: [(T, T); NB],
    /// Joint and centre of mass, y and z [m]: planar bodies from O in world axes, limbs in the frame of
    /// their carrier.
    pub joint: [[T; 2]; NB],
    pub c: [[T; 2]; NB],
    /// Joint of every body from O [m] (body 0: the ankle). x is 0 for planar bodies.
    pub p: [Vector3<T>; NB],
    /// Rotation matrix of every spatial body.
    pub R: [Matrix3<T>; NB],
    /// Joint axis of every spatial body, and the velocity at O per unit rate, p x axis.
    pub axis: [Vector3<T>; NB],
    pub arm: [Vector3<T>; NB],
    /// Velocity of the body-fixed point at O [m/s], and angular velocity [rad/s].
    pub v: [Vector3<T>; NB],
    pub w: [Vector3<T>; NB],
    /// Spatial acceleration for q'' = 0, gravity excluded [m/s2], [rad/s2].
    pub a: [Vector3<T>; NB],
    pub dw: [Vector3<T>; NB],
}

/// Point in the y-z plane, from O.
#[derive(Debug, Clone, Copy, Default)]
pub struct PlanarPoint<T = f64> {
    /// [m]
    pub y: T,
    pub z: T,
}

/// Rotate a vector of the y-z plane about x.
#[inline(always)]
fn rotate<T: Scalar>((s, c): (T, T), y: T, z: T) -> [T; 2] {
    [c * y - s * z, s * y + c * z]
}

/// Point at the distance `l` from `p` along a link; all links except the feet extend along their z.
#[inline(always)]
fn along_link<T: Scalar>(p: [T; 2], (s, c): (T, T), l: T) -> [T; 2] {
    [p[0] - s * l, p[1] + c * l]
}

/// x cos + y sin
#[inline(always)]
fn mix<T: Scalar>((s, c): (T, T), x: &Vector3<T>, y: &Vector3<T>) -> Vector3<T> {
    vec3::add(&vec3::scale(x, c), &vec3::scale(y, s))
}

/// x cos - y sin
#[inline(always)]
fn mix_back<T: Scalar>((s, c): (T, T), x: &Vector3<T>, y: &Vector3<T>) -> Vector3<T> {
    vec3::sub(&vec3::scale(x, c), &vec3::scale(y, s))
}

#[inline(always)]
fn column<T: Scalar>(R: &Matrix3<T>, i: usize) -> Vector3<T> {
    Vector3::new(R[(0, i)], R[(1, i)], R[(2, i)])
}

#[inline(always)]
fn from_columns<T: Scalar>([x, y, z]: &[Vector3<T>; 3]) -> Matrix3<T> {
    Matrix3::new(x[0], y[0], z[0], x[1], y[1], z[1], x[2], y[2], z[2])
}

impl<T: Scalar> Kinematics<T> {
    /// Poses of all bodies in world axes.
    pub fn positions(&mut self, models: impl ModelLanes<T>, q: &[T; NV]) {
        self.frames(models, q);
        self.limbs(models);
    }

    /// Poses of the limbs in world axes, after `frames`.
    pub fn limbs(&mut self, models: impl ModelLanes<T>) {
        let model = models.shape();
        if let Some(carrier) = model.carrier {
            for b in carrier + 1..model.bodies.len() {
                self.update_limb_body(models, carrier, b);
            }
        }
    }

    /// Positions for a time step: every body in the frame of its carrier, and all bodies except the arms in
    /// world axes.
    #[inline(always)]
    pub fn frames(&mut self, models: impl ModelLanes<T>, q: &[T; NV]) {
        // All angles at once: 1.2 % fewer instructions than `legs` and `trunk_and_limbs`.
        self.update_angles(models.shape(), 0..models.shape().bodies.len(), q);
        self.update_leg_kinematics(models);
        self.update_trunk(models);
        if let Some(carrier) = models.shape().carrier {
            self.update_limbs(models, carrier + 1..models.shape().bodies.len());
        }
        self.update_head(models);
    }

    /// The planar bodies alone.
    #[inline(always)]
    pub fn legs(&mut self, models: impl ModelLanes<T>, q: &[T; NV]) {
        self.update_angles(models.shape(), 0..models.shape().n_planar, q);
        self.update_leg_kinematics(models);
    }

    /// All other bodies, after `legs`; of limbs other than the head only the angles unless `with_limbs`.
    #[inline(always)]
    pub fn trunk_and_limbs(&mut self, models: impl ModelLanes<T>, q: &[T; NV], with_limbs: bool) {
        let (model, head) = (models.shape(), models.shape().head.0);
        self.update_angles(model, model.n_planar..model.bodies.len(), q);
        self.update_trunk(models);
        if with_limbs && let Some(carrier) = model.carrier {
            self.update_limbs(models, carrier + 1..model.bodies.len());
        } else if model.carrier.is_some_and(|carrier| head > carrier) {
            self.update_limbs(models, head..head + 1);
        }
        self.update_head(models);
    }

    /// Angles of a range of bodies with their sines and cosines.
    #[inline(always)]
    fn update_angles(&mut self, model: &Model, bodies: Range<usize>, q: &[T; NV]) {
        let (first, last) = (bodies.start.min(NB), bodies.end.min(NB));
        let n_planar = model.n_planar.min(NB);
        let first_limb = model.carrier.map_or(NB, |b| b + 1);
        for b in first..last {
            let (own, up) = (q[coordinate(b)], model.parent[b]);
            self.angle[b] = own;
            // Trunk bodies and the first body of a limb keep the angle to their parent; the others
            // accumulate.
            if b < n_planar && b > 0 || up >= first_limb {
                self.angle[b] = self.angle[up] + own;
            }
        }
        sin_cos(&self.angle[first..last], &mut self.sin_cos[first..last]);
    }

    #[inline(always)]
    fn update_leg_kinematics(&mut self, models: impl ModelLanes<T>) {
        let model = models.shape();
        let [y, z] = self.pivot_to_ankle;
        // If the parent is the previous body, its joint is taken from registers, here and in the other
        // passes over the tree. Through memory the legs take 20 % longer.
        let mut joint = rotate(self.sin_cos[0], y, z);
        for b in 0..model.n_planar.min(NB) {
            let (body, up) = (models.body(b), model.parent[b]);
            if b > 0 {
                let from = if up + 1 == b { joint } else { self.joint[up] };
                joint = along_link(from, self.sin_cos[up], body.above);
            }
            self.joint[b] = joint;
            let c = rotate(self.sin_cos[b], body.com[1], body.com[2]);
            self.c[b] = [joint[0] + c[0], joint[1] + c[1]];
            (self.p[b].y, self.p[b].z) = (joint[0], joint[1]);
        }
    }

    #[inline(always)]
    fn update_trunk(&mut self, models: impl ModelLanes<T>) {
        let model = models.shape();
        if let Some(carrier) = model.carrier {
            for b in model.n_planar..carrier + 1 {
                self.update_trunk_body(models, b);
            }
        }
    }

    /// Limb bodies in the frame of their carrier.
    #[inline(always)]
    fn update_limbs(&mut self, models: impl ModelLanes<T>, bodies: Range<usize>) {
        let model = models.shape();
        for b in bodies.start..bodies.end.min(NB) {
            let (body, up) = (models.body(b), model.parent[b]);
            self.joint[b] = if Some(up) == model.carrier {
                [T::zero(), body.above]
            } else {
                along_link(self.joint[up], self.sin_cos[up], body.above)
            };
            self.c[b] = along_link(self.joint[b], self.sin_cos[b], body.com[2]);
        }
    }

    #[inline(always)]
    fn update_head(&mut self, models: impl ModelLanes<T>) {
        let model = models.shape();
        if let Some(carrier) = model.carrier
            && model.head.0 > carrier
        {
            self.update_limb_body(models, carrier, model.head.0);
        }
    }

    #[inline(always)]
    fn update_trunk_body(&mut self, models: impl ModelLanes<T>, b: usize) {
        let model = models.shape();
        let up = model.parent[b];
        if up < model.n_planar {
            let (s, c) = self.sin_cos[up];
            let (zero, one) = (T::zero(), T::one());
            self.R[up] = Matrix3::new(one, zero, zero, zero, c, -s, zero, s, c);
        }
        let R_up = &self.R[up];
        let (x, y, z) = (column(R_up, 0), column(R_up, 1), column(R_up, 2));
        // Each trunk joint lies on the z axis of the body below.
        let above = models.number(|m| m.numbers[b].above);
        self.p[b] = vec3::add(&self.p[up], &vec3::scale(&z, above));
        let turn = self.sin_cos[b];
        let (axis, columns) = match model.axis[b] {
            Axis::X => (x, [x, mix(turn, &y, &z), mix_back(turn, &z, &y)]),
            Axis::Y => (y, [mix_back(turn, &x, &z), y, mix(turn, &z, &x)]),
            Axis::Z => (z, [mix(turn, &x, &y), mix_back(turn, &y, &x), z]),
        };
        self.axis[b] = axis;
        self.arm[b] = vec3::cross(&self.p[b], &axis);
        self.R[b] = from_columns(&columns);
    }

    #[inline(always)]
    fn update_limb_body(&mut self, models: impl ModelLanes<T>, carrier: usize, b: usize) {
        let R = self.R[carrier];
        let turn = self.sin_cos[b];
        let (x, y, z) = (column(&R, 0), column(&R, 1), column(&R, 2));
        let side = models.number(|m| m.numbers[b].side);
        let at = Vector3::new(side, self.joint[b][0], self.joint[b][1]);
        self.p[b] = vec3::add(&self.p[carrier], &vec3::apply(&R, &at));
        self.axis[b] = x;
        self.arm[b] = vec3::cross(&self.p[b], &x);
        self.R[b] = from_columns(&[x, mix(turn, &y, &z), mix_back(turn, &z, &y)]);
    }

    /// Torque at body `b`'s joint of a force `f` with moment `n` about O: S_b . (n, f).
    #[inline(always)]
    pub fn along(&self, model: &Model, b: usize, f: &Vector3<T>, n: &Vector3<T>) -> T {
        if b == 0 {
            n.x
        } else if b < model.n_planar {
            n.x + self.p[b].z * f.y - self.p[b].y * f.z
        } else {
            let (axis, arm) = (&self.axis[b], &self.arm[b]);
            (axis[0] * n[0] + axis[1] * n[1] + axis[2] * n[2])
                + (arm[0] * f[0] + arm[1] * f[1] + arm[2] * f[2])
        }
    }

    /// Position from O [m] of a point given in a body frame.
    #[inline(always)]
    pub fn point(&self, model: &Model, body: usize, local: &Vector3<T>) -> Vector3<T> {
        if body < model.n_planar {
            let (s, c) = self.sin_cos[body];
            let (y, z) = (c * local.y - s * local.z, s * local.y + c * local.z);
            return vec3::add(&self.p[body], &Vector3::new(local.x, y, z));
        }
        vec3::add(&self.p[body], &vec3::apply(&self.R[body], local))
    }

    /// Point of the free foot's sole at the distance `along` in front of the ankle, from O [m].
    #[inline(always)]
    pub fn sole_point(&self, models: impl ModelLanes<T>, along: T) -> PlanarPoint<T> {
        self.sole_point_of(models, FREE_FOOT, along)
    }

    /// The same for either foot; `foot` is body 0 or `FREE_FOOT`.
    #[inline(always)]
    pub fn sole_point_of(
        &self,
        models: impl ModelLanes<T>,
        foot: usize,
        along: T,
    ) -> PlanarPoint<T> {
        let (s, c) = self.sin_cos[foot];
        let p = self.p[foot];
        let z = models.number(|m| m.sole.z);
        PlanarPoint {
            y: p.y + c * along - s * z,
            z: p.z + s * along + c * z,
        }
    }

    /// Top of the head from O [m].
    #[inline(always)]
    pub fn head(&self, models: impl ModelLanes<T>) -> Vector3<T> {
        self.point_of_head(models, |m| &m.head.1)
    }

    /// The point psi of the head from O [m], Eq. 14.
    #[inline(always)]
    pub fn psi(&self, models: impl ModelLanes<T>) -> Vector3<T> {
        self.point_of_head(models, |m| &m.psi)
    }

    #[inline(always)]
    fn point_of_head(
        &self,
        models: impl ModelLanes<T>,
        place: fn(&Model) -> &Vector3<f64>,
    ) -> Vector3<T> {
        let model = models.shape();
        let local = Vector3::new(
            models.number(|m| place(m).x),
            models.number(|m| place(m).y),
            models.number(|m| place(m).z),
        );
        self.point(model, model.head.0, &local)
    }
}
