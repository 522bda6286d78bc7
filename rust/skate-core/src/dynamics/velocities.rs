//! Velocities and bias accelerations of the bodies, after the positions of `kinematics`.

use crate::{
    dynamics::kinematics::Kinematics,
    model::{
        Model,
        layout::{NB, NV, coordinate},
    },
    numeric::{scalar::Scalar, twist::Twist, vec3},
};
use nalgebra::Vector3;

impl<T: Scalar> Kinematics<T> {
    /// Velocities and bias accelerations of all bodies. Needs `positions`.
    pub fn velocities(&mut self, model: &Model, v: &[T; NV]) {
        self.planar_velocities(model, v);
        for b in model.n_planar..model.bodies.len() {
            self.propagate(model, b, v[coordinate(b)]);
        }
    }

    /// Velocities of the planar bodies. Needs `frames`.
    #[inline(always)]
    pub fn planar_velocities(&mut self, model: &Model, v: &[T; NV]) {
        // w.x is the angular rate; v.y and v.z are the velocity at O. The joint's motion subspace is S =
        // (x, p cross x).
        let mut w = v[coordinate(0)];
        let (mut vel, mut acc) = ([v[0], v[1]], [w * v[1], -w * v[0]]);
        for b in 0..model.n_planar.min(NB) {
            if b > 0 {
                let up = model.parent[b];
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
            self.w[b].x = w;
            (self.v[b].y, self.v[b].z) = (vel[0], vel[1]);
            (self.a[b].y, self.a[b].z) = (acc[0], acc[1]);
        }
    }

    /// Velocities of the trunk and the head. Needs `frames` and `planar_velocities`.
    #[inline(always)]
    pub fn head_velocities(&mut self, model: &Model, v: &[T; NV]) {
        let Some(carrier) = model.carrier else {
            return;
        };
        for b in model.n_planar..=carrier {
            self.propagate(model, b, v[coordinate(b)]);
        }
        let head = model.head.0;
        if head > carrier {
            self.propagate(model, head, v[coordinate(head)]);
        }
    }

    /// Velocity of a trunk or limb body from its parent's.
    #[inline(always)]
    fn propagate(&mut self, model: &Model, b: usize, rate: T) {
        let up = model.parent[b];
        let angular = vec3::scale(&self.axis[b], rate);
        let linear = vec3::scale(&self.arm[b], rate);
        let (w, vel) = (self.w[up], self.v[up]);
        self.w[b] = vec3::add(&w, &angular);
        self.v[b] = vec3::add(&vel, &linear);
        self.dw[b] = vec3::add(&self.dw[up], &vec3::cross(&w, &angular));
        let turning = vec3::add(&self.a[up], &vec3::cross(&w, &linear));
        self.a[b] = vec3::add(&turning, &vec3::cross(&vel, &angular));
    }

    /// Acceleration of a point (y and z from O) fixed to a planar body for q'' = 0 [m/s2].
    #[inline(always)]
    pub fn acceleration(&self, b: usize, [y, z]: [T; 2]) -> [T; 2] {
        let (a, v, w) = (&self.a[b], &self.v[b], self.w[b].x);
        [a.y - w * (v.z + w * y), a.z + w * (v.y - w * z)]
    }

    /// Velocity of a body-fixed point, given from O [m/s].
    #[inline(always)]
    pub fn point_velocity(&self, body: usize, point: &Vector3<T>) -> Vector3<T> {
        vec3::add(&self.v[body], &vec3::cross(&self.w[body], point))
    }

    /// Bias acceleration J' q' of a body-fixed point, given from O [m/s2].
    #[inline(always)]
    pub fn point_bias(&self, body: usize, point: &Vector3<T>) -> Vector3<T> {
        let velocity = self.point_velocity(body, point);
        let turning = vec3::add(&self.a[body], &vec3::cross(&self.dw[body], point));
        vec3::add(&turning, &vec3::cross(&self.w[body], &velocity))
    }
}

impl Kinematics {
    /// Joint axis of a coordinate.
    #[inline(always)]
    pub fn joint_axis(&self, model: &Model, c: usize) -> Twist {
        let zero = Vector3::zeros();
        match c {
            0 => Twist {
                w: zero,
                v: Vector3::y(),
            },
            1 => Twist {
                w: zero,
                v: Vector3::z(),
            },
            2 => Twist {
                w: Vector3::x(),
                v: zero,
            },
            c if c - 2 < model.n_planar => {
                let p = &self.p[c - 2];
                Twist {
                    w: Vector3::x(),
                    v: Vector3::new(0.0, p.z, -p.y),
                }
            }
            c => Twist {
                w: self.axis[c - 2],
                v: self.arm[c - 2],
            },
        }
    }
}
