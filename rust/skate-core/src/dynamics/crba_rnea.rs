//! Eq. 9: inertia matrix by the composite-rigid-body algorithm, bias forces by the recursive Newton-Euler
//! algorithm, and momentum.

use crate::{
    dynamics::kinematics::Kinematics,
    model::{
        Model,
        layout::{NB, NV, coordinate},
    },
    numeric::twist::{Twist, Wrench},
};
use nalgebra::{DMatrix, Matrix3, Vector3};

/// Inertias about O in world axes. Planar bodies use m, h.y, h.z and the xx entry of J only.
#[derive(Debug, Clone, Default)]
pub struct Inertias {
    /// First moments m c [kg m].
    h: [Vector3<f64>; NB],
    /// Second moments about O [kg m2].
    J: [Matrix3<f64>; NB],
}

impl Inertias {
    /// Inertias of the single bodies. Needs `Kinematics::positions`.
    pub fn update(&mut self, model: &Model, kin: &Kinematics) {
        for (b, body) in model.bodies.iter().enumerate() {
            let c = kin.point(model, b, &body.com);
            let m = body.mass;
            self.h[b] = c * m;
            if b < model.n_planar {
                self.J[b].m11 = body.inertia.m11 + m * (c.y * c.y + c.z * c.z);
            } else {
                let R = &kin.R[b];
                self.J[b] = R * body.inertia * R.transpose()
                    + (Matrix3::from_diagonal_element(c.norm_squared()) - c * c.transpose()) * m;
            }
        }
    }

    /// First moment and second moment about O of a body.
    pub(super) fn body(&self, b: usize) -> (Vector3<f64>, Matrix3<f64>) {
        (self.h[b], self.J[b])
    }

    /// M(q) by the composite-rigid-body algorithm (Featherstone 2008, table 6.2, in one common frame).
    pub fn crba(&self, model: &Model, kin: &Kinematics) -> DMatrix<f64> {
        let (mut mass, mut h, mut J) = (model.numbers.map(|body| body.mass), self.h, self.J);
        for b in (1..model.bodies.len()).rev() {
            let up = model.parent[b];
            mass[up] += mass[b];
            h[up] += h[b];
            J[up] += J[b];
        }
        let mut M = DMatrix::zeros(model.n, model.n);
        for c in 0..model.n {
            // y0 and z0 move the same body as q1.
            let (axis, b) = (kin.joint_axis(model, c), c.saturating_sub(2));
            // Force and moment about O for unit acceleration of the composite body along the joint.
            let force = Wrench {
                n: J[b] * axis.w + h[b].cross(&axis.v),
                f: axis.v * mass[b] + axis.w.cross(&h[b]),
            };
            for &a in model.ancestors[c][..model.depth[c]].iter().chain([&c]) {
                let entry = kin.joint_axis(model, a).dot(&force);
                (M[(c, a)], M[(a, c)]) = (entry, entry);
            }
        }
        M
    }

    /// Inverse dynamics by RNEA: tau = M(q) q'' + h(q, q') + g(q). Needs `Kinematics::velocities`.
    pub fn inverse_dynamics(
        &self,
        model: &Model,
        kin: &Kinematics,
        qdd: &[f64; NV],
        out: &mut [f64; NV],
    ) {
        let gravity = Vector3::new(0.0, 0.0, model.scene.ice.gravity);
        let pivot = Twist {
            w: Vector3::zeros(),
            v: Vector3::new(0.0, qdd[0], qdd[1]),
        };
        // A joint's q'' adds the same spatial acceleration to all bodies that it carries.
        let mut added = [Twist::default(); NB];
        let mut forces = [Wrench::default(); NB];
        for b in 0..model.bodies.len() {
            let (m, h, J) = (model.numbers[b].mass, &self.h[b], &self.J[b]);
            let (w, v, c) = (&kin.w[b], &kin.v[b], coordinate(b));
            let up = if b == 0 {
                pivot
            } else {
                added[model.parent[b]]
            };
            added[b] = up.add_scaled(&kin.joint_axis(model, c), qdd[c]);
            let (a, dw) = (kin.a[b] + added[b].v + gravity, kin.dw[b] + added[b].w);
            let linear = v * m + w.cross(h);
            let angular = J * w + h.cross(v);
            forces[b] = Wrench {
                n: J * dw + h.cross(&a) + w.cross(&angular) + v.cross(&linear),
                f: a * m + dw.cross(h) + w.cross(&linear),
            };
        }
        for b in (0..model.bodies.len()).rev() {
            let c = coordinate(b);
            out[c] = kin.joint_axis(model, c).dot(&forces[b]);
            if b > 0 {
                let up = model.parent[b];
                forces[up] = forces[up].add_scaled(&forces[b], 1.0);
            }
        }
        (out[0], out[1]) = (forces[0].f.y, forces[0].f.z);
    }

    /// Linear momentum [kg m/s] and sagittal angular momentum about O [kg m2/s].
    pub fn momentum(&self, model: &Model, kin: &Kinematics) -> ([f64; 2], f64) {
        let (mut p, mut l) = ([0.0; 2], 0.0);
        for (b, body) in model.bodies.iter().enumerate() {
            let (h, w, v) = (&self.h[b], &kin.w[b], &kin.v[b]);
            let linear = v * body.mass + w.cross(h);
            p[0] += linear.y;
            p[1] += linear.z;
            l += h.y * v.z - h.z * v.y;
            l += (self.J[b] * w).x;
        }
        (p, l)
    }
}
