//! Where the bodies are and how they move.
//!
//! Everything is expressed in axes parallel to the world's, about the pivot O of the supporting
//! foot: composite inertias and accumulated forces are then plain sums, without transforms
//! (Featherstone 2008, sections 2.9 and 6.2, in one common frame). Bodies that move in the sagittal
//! plane keep three of the six components: the rotation about x and the motion along y and z. A step
//! needs less: `frames` leaves the arms in the frame of the body that carries them, and what
//! `positions` and `velocities` say of the arms is then of an earlier state.

use crate::{
    angles::sin_cos,
    model::{Axis, FREE_FOOT, Model, NB, NV, coordinate},
};
use nalgebra::{Matrix3, Vector3};

/// Workspace of one evaluation; every field is written before it is read.
#[derive(Debug, Clone)]
pub struct Kinematics {
    /// Pivot -> ankle of the supporting foot when it is flat [m]; set before `positions`.
    pub pivot_to_ankle: [f64; 2],
    /// Angle to the world of every planar body, to its parent of every body of the trunk, to the body
    /// that carries it of a limb's [rad].
    pub angle: [f64; NB],
    /// Its sine and cosine.
    pub sin_cos: [(f64, f64); NB],
    /// Joint and centre of mass, y and z: planar bodies from O in the world's axes, limbs in the frame
    /// of the body that carries them [m].
    pub joint: [[f64; 2]; NB],
    pub c: [[f64; 2]; NB],
    /// Joint of every body from O [m] (body 0: the ankle); x is 0 for planar bodies, which do not need it.
    pub p: [Vector3<f64>; NB],
    /// Orientation of every spatial body.
    pub R: [Matrix3<f64>; NB],
    /// Axis of every spatial body's joint, and the velocity at O per unit rate, p x axis.
    pub axis: [Vector3<f64>; NB],
    pub arm: [Vector3<f64>; NB],
    /// Velocity at O of a point fixed to the body [m/s], and angular velocity [rad/s].
    pub v: [Vector3<f64>; NB],
    pub w: [Vector3<f64>; NB],
    /// Spatial acceleration for q'' = 0, gravity left out [m/s2], [rad/s2].
    pub a: [Vector3<f64>; NB],
    pub dw: [Vector3<f64>; NB],
}

impl Default for Kinematics {
    fn default() -> Self {
        let zero = [Vector3::zeros(); NB];
        Self {
            pivot_to_ankle: [0.0; 2],
            angle: [0.0; NB],
            sin_cos: [(0.0, 1.0); NB],
            joint: [[0.0; 2]; NB],
            c: [[0.0; 2]; NB],
            p: zero,
            R: [Matrix3::identity(); NB],
            axis: zero,
            arm: zero,
            v: zero,
            w: zero,
            a: zero,
            dw: zero,
        }
    }
}

/// Position, velocity, bias acceleration of a point, from O or the world as its maker says.
#[derive(Debug, Clone, Copy, Default)]
pub struct PlanarPoint {
    /// From O [m].
    pub y: f64,
    pub z: f64,
}

/// A vector of the y-z plane, turned about x.
#[inline]
fn turn((s, c): (f64, f64), y: f64, z: f64) -> [f64; 2] {
    [c * y - s * z, s * y + c * z]
}

/// The point at the distance `l` from `p` along a link: all links but the feet extend along their z.
#[inline]
fn ahead(p: [f64; 2], (s, c): (f64, f64), l: f64) -> [f64; 2] {
    [p[0] - s * l, p[1] + c * l]
}

impl Kinematics {
    /// Poses of all bodies in the world's axes.
    pub fn positions(&mut self, model: &Model, q: &[f64; NV]) {
        self.frames(model, q);
        if let Some(carrier) = model.carrier {
            for b in carrier + 1..model.bodies.len() {
                self.place_limb(model, carrier, b);
            }
        }
    }

    /// What a step needs: every body in its carrier's frame; in the world's axes all but the arms.
    pub fn frames(&mut self, model: &Model, q: &[f64; NV]) {
        let bodies = &model.bodies[..model.bodies.len().min(NB)];
        let n_planar = model.n_planar.min(bodies.len());
        let first_limb = model.carrier.map_or(bodies.len(), |b| b + 1);
        for (b, body) in bodies.iter().enumerate() {
            let own = q[coordinate(b)];
            self.angle[b] = own;
            // A trunk's body counts from its parent; the first of a limb from the trunk.
            if b < n_planar && b > 0 || body.parent >= first_limb {
                self.angle[b] = self.angle[body.parent] + own;
            }
        }
        let n = bodies.len();
        sin_cos(&self.angle[..n], &mut self.sin_cos[..n]);
        let [y, z] = self.pivot_to_ankle;
        // A body whose parent is the one before it takes from registers, here and in the other passes
        // over the tree: through memory the legs alone would take a fifth more time.
        let mut joint = turn(self.sin_cos[0], y, z);
        for (b, body) in bodies[..n_planar].iter().enumerate() {
            let up = body.parent;
            if b > 0 {
                let from = if up + 1 == b { joint } else { self.joint[up] };
                joint = ahead(from, self.sin_cos[up], body.offset.z);
            }
            self.joint[b] = joint;
            let c = turn(self.sin_cos[b], body.com.y, body.com.z);
            self.c[b] = [joint[0] + c[0], joint[1] + c[1]];
            self.p[b] = Vector3::new(0.0, joint[0], joint[1]);
        }
        let Some(carrier) = model.carrier else {
            return;
        };
        for b in n_planar..=carrier {
            self.place_trunk(model, b);
        }
        for (b, body) in bodies.iter().enumerate().skip(first_limb) {
            let up = body.parent;
            self.joint[b] = if up == carrier {
                [0.0, body.offset.z]
            } else {
                ahead(self.joint[up], self.sin_cos[up], body.offset.z)
            };
            self.c[b] = ahead(self.joint[b], self.sin_cos[b], body.com.z);
        }
        if model.head.0 > carrier {
            self.place_limb(model, carrier, model.head.0);
        }
    }

    fn place_trunk(&mut self, model: &Model, b: usize) {
        let body = &model.bodies[b];
        let up = body.parent;
        if up < model.n_planar {
            let (s, c) = self.sin_cos[up];
            self.R[up] = Matrix3::new(1.0, 0.0, 0.0, 0.0, c, -s, 0.0, s, c);
        }
        let R_up = &self.R[up];
        let (x, y, z) = (R_up.column(0), R_up.column(1), R_up.column(2));
        // The trunk's links stand on each other.
        self.p[b] = self.p[up] + z * body.offset.z;
        let (s, c) = self.sin_cos[b];
        let (axis, columns) = match body.axis {
            Axis::X => (x, [x.into(), y * c + z * s, z * c - y * s]),
            Axis::Y => (y, [x * c - z * s, y.into(), z * c + x * s]),
            Axis::Z => (z, [x * c + y * s, y * c - x * s, z.into()]),
        };
        self.axis[b] = axis.into();
        self.arm[b] = self.p[b].cross(&self.axis[b]);
        self.R[b] = Matrix3::from_columns(&columns);
    }

    fn place_limb(&mut self, model: &Model, carrier: usize, b: usize) {
        let R = self.R[carrier];
        let (s, c) = self.sin_cos[b];
        let (x, y, z) = (R.column(0), R.column(1), R.column(2));
        let at = Vector3::new(model.side[b], self.joint[b][0], self.joint[b][1]);
        self.p[b] = self.p[carrier] + R * at;
        self.axis[b] = x.into();
        self.arm[b] = self.p[b].cross(&self.axis[b]);
        self.R[b] = Matrix3::from_columns(&[x.into(), y * c + z * s, z * c - y * s]);
    }

    /// Velocities and bias accelerations of all bodies; needs `positions`.
    pub fn velocities(&mut self, model: &Model, v: &[f64; NV]) {
        self.planar_velocities(model, v);
        for b in model.n_planar..model.bodies.len() {
            self.follow(model, b, v[coordinate(b)]);
        }
    }

    /// The same for the planar bodies; needs `frames`.
    pub fn planar_velocities(&mut self, model: &Model, v: &[f64; NV]) {
        let bodies = &model.bodies[..model.n_planar.min(NB)];
        // x of w is the rate, y and z of v the velocity at O. S = (x, p cross x).
        let mut w = v[coordinate(0)];
        let (mut vel, mut acc) = ([v[0], v[1]], [w * v[1], -w * v[0]]);
        for (b, body) in bodies.iter().enumerate() {
            if b > 0 {
                let up = body.parent;
                if up + 1 != b {
                    w = self.w[up].x;
                    (vel, acc) = ([self.v[up].y, self.v[up].z], [self.a[up].y, self.a[up].z]);
                }
                let (rate, [y, z]) = (v[coordinate(b)], self.joint[b]);
                acc[0] += rate * (w * y + vel[1]);
                acc[1] += rate * (w * z - vel[0]);
                vel = [vel[0] + z * rate, vel[1] - y * rate];
                w += rate;
            }
            self.w[b] = Vector3::new(w, 0.0, 0.0);
            self.dw[b] = Vector3::zeros();
            self.v[b] = Vector3::new(0.0, vel[0], vel[1]);
            self.a[b] = Vector3::new(0.0, acc[0], acc[1]);
        }
    }

    /// The same for the trunk and the head; needs `frames` and `planar_velocities`.
    pub fn head_velocities(&mut self, model: &Model, v: &[f64; NV]) {
        let Some(carrier) = model.carrier else {
            return;
        };
        for b in model.n_planar..=carrier {
            self.follow(model, b, v[coordinate(b)]);
        }
        let head = model.head.0;
        if head > carrier {
            self.follow(model, head, v[coordinate(head)]);
        }
    }

    /// Velocity of a body of the trunk or a limb from its parent's.
    fn follow(&mut self, model: &Model, b: usize, rate: f64) {
        let up = model.bodies[b].parent;
        let angular = self.axis[b] * rate;
        let linear = self.arm[b] * rate;
        let (w, vel) = (self.w[up], self.v[up]);
        self.w[b] = w + angular;
        self.v[b] = vel + linear;
        self.dw[b] = self.dw[up] + w.cross(&angular);
        self.a[b] = self.a[up] + w.cross(&linear) + vel.cross(&angular);
    }

    /// Acceleration of a point (y and z from O) of a planar body for q'' = 0 [m/s2].
    #[inline]
    pub fn acceleration(&self, b: usize, [y, z]: [f64; 2]) -> [f64; 2] {
        let (a, v, w) = (&self.a[b], &self.v[b], self.w[b].x);
        [a.y - w * (v.z + w * y), a.z + w * (v.y - w * z)]
    }

    /// A vector in a planar body's frame, in the world's axes.
    #[inline]
    pub fn turned(&self, body: usize, y: f64, z: f64) -> [f64; 2] {
        turn(self.sin_cos[body], y, z)
    }

    /// Component along body `b`'s joint of a force `f` with moment `n` about O: S_b . (n, f).
    #[inline]
    pub fn along(&self, model: &Model, b: usize, f: &Vector3<f64>, n: &Vector3<f64>) -> f64 {
        if b == 0 {
            n.x
        } else if b < model.n_planar {
            n.x + self.p[b].z * f.y - self.p[b].y * f.z
        } else {
            self.axis[b].dot(n) + self.arm[b].dot(f)
        }
    }

    /// A point given in a body's frame, from O [m].
    pub fn point(&self, model: &Model, body: usize, local: &Vector3<f64>) -> Vector3<f64> {
        if body < model.n_planar {
            let (s, c) = self.sin_cos[body];
            let (y, z) = (c * local.y - s * local.z, s * local.y + c * local.z);
            return self.p[body] + Vector3::new(local.x, y, z);
        }
        self.p[body] + self.R[body] * local
    }

    /// Velocity of a point (from O) fixed to a body [m/s].
    pub fn point_velocity(&self, body: usize, point: &Vector3<f64>) -> Vector3<f64> {
        self.v[body] + self.w[body].cross(point)
    }

    /// Acceleration of a point (from O) fixed to a body for q'' = 0: the rate term J' q' [m/s2].
    pub fn point_bias(&self, body: usize, point: &Vector3<f64>) -> Vector3<f64> {
        let velocity = self.point_velocity(body, point);
        self.a[body] + self.dw[body].cross(point) + self.w[body].cross(&velocity)
    }

    /// A point of the free foot's sole, `along` ahead of the ankle, from O [m].
    pub fn sole_point(&self, model: &Model, along: f64) -> PlanarPoint {
        self.sole_point_of(model, FREE_FOOT, along)
    }

    /// The same for either foot: body 0 or `FREE_FOOT`.
    pub fn sole_point_of(&self, model: &Model, foot: usize, along: f64) -> PlanarPoint {
        let (s, c) = self.sin_cos[foot];
        let p = self.p[foot];
        let z = model.sole.z;
        PlanarPoint {
            y: p.y + c * along - s * z,
            z: p.z + s * along + c * z,
        }
    }

    /// Top of the head from O [m].
    pub fn head(&self, model: &Model) -> Vector3<f64> {
        let (body, local) = model.head;
        self.point(model, body, &local)
    }
}
