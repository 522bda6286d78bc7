//! Eq. 9: inertia matrix by the composite-rigid-body algorithm, bias forces by the recursive Newton-Euler
//! algorithm, and momentum.

use crate::{
    dynamics::{kinematics::Kinematics, tree_matrix::PackedMatrix},
    model::{
        Model,
        layout::{NB, NV, coordinate},
    },
};
use nalgebra::{Matrix3, Vector3};

/// Inertias about O in world axes. Planar bodies use m, h.y, h.z and the xx entry of J only.
#[derive(Debug, Clone)]
pub struct Inertias {
    /// First moments m c [kg m].
    h: [Vector3<f64>; NB],
    /// Second moments about O [kg m2].
    J: [Matrix3<f64>; NB],
    /// Composite bodies: mass, first and second moments.
    mass_c: [f64; NB],
    h_c: [Vector3<f64>; NB],
    J_c: [Matrix3<f64>; NB],
}

impl Default for Inertias {
    fn default() -> Self {
        let (h, J) = ([Vector3::zeros(); NB], [Matrix3::zeros(); NB]);
        Self {
            h,
            J,
            mass_c: [0.0; NB],
            h_c: h,
            J_c: J,
        }
    }
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
    pub fn crba(&mut self, model: &Model, kin: &Kinematics, M: &mut PackedMatrix) {
        let nb = model.bodies.len();
        for (b, body) in model.bodies.iter().enumerate() {
            self.mass_c[b] = body.mass;
            self.h_c[b] = self.h[b];
            self.J_c[b] = self.J[b];
        }
        for b in (1..nb).rev() {
            let up = model.bodies[b].parent;
            self.mass_c[up] += self.mass_c[b];
            self.h_c[up] += self.h_c[b];
            if up < model.n_planar {
                self.J_c[up].m11 += self.J_c[b].m11;
            } else {
                self.J_c[up] += self.J_c[b];
            }
        }
        for b in 0..nb {
            let c = coordinate(b);
            let row = &mut M.rows[c];
            let (m, h) = (self.mass_c[b], self.h_c[b]);
            // Force and moment about O for unit acceleration of the composite body along the joint.
            let (f, n) = if b < model.n_planar {
                let p = if b == 0 { Vector3::zeros() } else { kin.p[b] };
                let f = Vector3::new(0.0, m * p.z - h.z, h.y - m * p.y);
                (
                    f,
                    Vector3::new(self.J_c[b].m11 - h.y * p.y - h.z * p.z, 0.0, 0.0),
                )
            } else {
                let angular = kin.axis[b];
                let linear = kin.arm[b];
                (
                    linear * m + angular.cross(&h),
                    self.J_c[b] * angular + h.cross(&linear),
                )
            };
            row[0] = f.y;
            row[1] = f.z;
            let depth = model.depth[c];
            for (entry, &a) in row[2..depth].iter_mut().zip(&model.ancestors[c][2..depth]) {
                *entry = kin.along(model, a - 2, &f, &n);
            }
            row[depth] = kin.along(model, b, &f, &n);
        }
        // y0 and z0 translate the total mass.
        M.rows[0][0] = self.mass_c[0];
        M.rows[1][0] = 0.0;
        M.rows[1][1] = self.mass_c[0];
    }

    /// Bias forces h(q, q') + g(q), by RNEA with q'' = 0. Needs `Kinematics::velocities`.
    pub fn bias(&self, model: &Model, kin: &Kinematics, out: &mut [f64; NV]) {
        self.rnea(model, kin, &kin.a, &kin.dw, out);
    }

    /// Generalised forces for given spatial accelerations of the bodies at O, gravity excluded.
    fn rnea(
        &self,
        model: &Model,
        kin: &Kinematics,
        a: &[Vector3<f64>; NB],
        dw: &[Vector3<f64>; NB],
        out: &mut [f64; NV],
    ) {
        let g = model.scene.ice.gravity;
        let nb = model.bodies.len();
        let mut f = [Vector3::zeros(); NB];
        let mut n = [Vector3::zeros(); NB];
        for b in 0..nb {
            let (m, h, w, v) = (model.bodies[b].mass, &self.h[b], &kin.w[b], &kin.v[b]);
            if b < model.n_planar {
                let (w, dw, ay, az) = (w.x, dw[b].x, a[b].y, a[b].z + g);
                let (ly, lz) = (m * v.y - w * h.z, m * v.z + w * h.y);
                f[b].y = m * ay - dw * h.z - w * lz;
                f[b].z = m * az + dw * h.y + w * ly;
                n[b].x = self.J[b].m11 * dw + h.y * az - h.z * ay + v.y * lz - v.z * ly;
            } else {
                let acc = a[b] + Vector3::new(0.0, 0.0, g);
                let linear = v * m + w.cross(h);
                let angular = self.J[b] * w + h.cross(v);
                f[b] = acc * m + dw[b].cross(h) + w.cross(&linear);
                n[b] = self.J[b] * dw[b] + h.cross(&acc) + w.cross(&angular) + v.cross(&linear);
            }
        }
        for b in (0..nb).rev() {
            out[coordinate(b)] = kin.along(model, b, &f[b], &n[b]);
            if b > 0 {
                let up = model.bodies[b].parent;
                f[up] += f[b];
                n[up] += n[b];
            }
        }
        out[0] = f[0].y;
        out[1] = f[0].z;
    }

    /// Inverse dynamics: tau = M(q) q'' + h(q, q') + g(q). Needs `Kinematics::velocities`.
    pub fn inverse_dynamics(
        &self,
        model: &Model,
        kin: &Kinematics,
        qdd: &[f64; NV],
        out: &mut [f64; NV],
    ) {
        let mut a = kin.a;
        let mut dw = kin.dw;
        a[0] += Vector3::new(0.0, qdd[0], qdd[1]);
        dw[0].x += qdd[2];
        // A joint's q'' adds the same spatial acceleration to all bodies that it carries.
        let mut da = [Vector3::zeros(); NB];
        let mut ddw = [Vector3::zeros(); NB];
        da[0] = Vector3::new(0.0, qdd[0], qdd[1]);
        ddw[0] = Vector3::new(qdd[2], 0.0, 0.0);
        for b in 1..model.bodies.len() {
            let up = model.bodies[b].parent;
            let axis = if b < model.n_planar {
                Vector3::x()
            } else {
                kin.axis[b]
            };
            let angular = axis * qdd[coordinate(b)];
            da[b] = da[up] + kin.p[b].cross(&angular);
            ddw[b] = ddw[up] + angular;
            a[b] += da[b];
            dw[b] += ddw[b];
        }
        self.rnea(model, kin, &a, &dw, out);
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
            l += if b < model.n_planar {
                self.J[b].m11 * w.x
            } else {
                (self.J[b] * w).x
            };
        }
        (p, l)
    }
}
