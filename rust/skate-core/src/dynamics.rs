//! Eq. 9: the inertia matrix by composite bodies, the bias by Newton and Euler, and sums of them.

use crate::{
    kinematics::Kinematics,
    model::{DEPTH, Model, NB, NV, ROOT, coordinate},
    packed::PackedMatrix,
    symmetric::Symmetric,
};
use nalgebra::Vector3;

/// Inertias about O, axes parallel to the world's. Planar bodies use m, h.y, h.z and J.xx only.
#[derive(Debug, Clone)]
pub struct Inertias {
    /// First moment m c [kg m].
    h: [Vector3<f64>; NB],
    /// Second moment about O [kg m2].
    J: [Symmetric; NB],
    /// Composite bodies: mass, first and second moment.
    mass_c: [f64; NB],
    h_c: [Vector3<f64>; NB],
    J_c: [Symmetric; NB],
}

impl Default for Inertias {
    fn default() -> Self {
        let (h, J) = ([Vector3::zeros(); NB], [Symmetric::default(); NB]);
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
    /// Inertias of the single bodies; needs `Kinematics::positions`.
    pub fn update(&mut self, model: &Model, kin: &Kinematics) {
        let n_planar = model.n_planar.min(NB);
        for (b, body) in model.bodies.iter().enumerate().take(NB) {
            let m = body.mass;
            if b < n_planar {
                let [y, z] = kin.c[b];
                self.h[b] = Vector3::new(0.0, m * y, m * z);
                self.J[b].xx = body.inertia.m11 + m * (y * y + z * z);
                continue;
            }
            let R = &kin.R[b];
            let c = kin.p[b] + R * body.com;
            self.h[b] = c * m;
            self.J[b] = match body.rod {
                Some([across, axial]) => Symmetric::of_rod(across, axial, &R.column(2).into()),
                None => Symmetric::of_turned(R, &body.inertia),
            };
            self.J[b] += Symmetric::of_point(m, &c);
        }
    }

    /// M(q) by composite bodies (CRBA; Featherstone 2008, table 6.2, in one common frame).
    pub fn crba(&mut self, model: &Model, kin: &Kinematics, M: &mut PackedMatrix) {
        let nb = model.bodies.len().min(NB);
        let n_planar = model.n_planar.min(NB);
        for (mass, body) in self.mass_c.iter_mut().zip(&model.bodies) {
            *mass = body.mass;
        }
        (self.h_c, self.J_c) = (self.h, self.J);
        for b in (1..nb).rev() {
            let up = model.bodies[b].parent;
            self.mass_c[up] += self.mass_c[b];
            let (h, J) = (self.h_c[b], self.J_c[b]);
            self.h_c[up] += h;
            if up < n_planar {
                self.J_c[up].xx += J.xx;
            } else {
                self.J_c[up] += J;
            }
        }
        for b in 0..nb {
            let c = coordinate(b);
            let row = &mut M.rows[c];
            let (m, h, J) = (self.mass_c[b], &self.h_c[b], &self.J_c[b]);
            // Force and moment about O that turn the composite body with unit acceleration.
            let (f, n, own) = if b < n_planar {
                let (y, z) = if b == 0 {
                    (0.0, 0.0)
                } else {
                    (kin.p[b].y, kin.p[b].z)
                };
                let f = Vector3::new(0.0, m * z - h.z, h.y - m * y);
                let n = J.xx - h.y * y - h.z * z;
                (f, Vector3::new(n, 0.0, 0.0), n + z * f.y - y * f.z)
            } else {
                let (axis, arm) = (&kin.axis[b], &kin.arm[b]);
                let f = arm * m + axis.cross(h);
                let n = J.times(axis) + h.cross(arm);
                (f, n, axis.dot(&n) + arm.dot(&f))
            };
            let depth = model.depth[c].min(DEPTH - 1);
            row[0] = f.y;
            row[1] = f.z;
            row[2] = n.x;
            let in_line = model.in_line[c].min(depth);
            for (entry, p) in row[..in_line].iter_mut().skip(ROOT).zip(&kin.p[1..]) {
                *entry = n.x + p.z * f.y - p.y * f.z;
            }
            for d in in_line.max(ROOT)..depth {
                row[d] = kin.along(model, model.ancestors[c][d] - 2, &f, &n);
            }
            row[depth] = own;
        }
        // y0 and z0 move all of the mass.
        M.rows[0][0] = self.mass_c[0];
        M.rows[1][0] = 0.0;
        M.rows[1][1] = self.mass_c[0];
    }

    /// h(q, q') + g(q) by Newton and Euler (RNEA with q'' = 0); needs `Kinematics::velocities`.
    pub fn bias(&self, model: &Model, kin: &Kinematics, out: &mut [f64; NV]) {
        self.rnea(model, kin, &kin.a, &kin.dw, out);
    }

    /// Generalised forces for given spatial accelerations of the bodies at O (gravity left out).
    fn rnea(
        &self,
        model: &Model,
        kin: &Kinematics,
        a: &[Vector3<f64>; NB],
        dw: &[Vector3<f64>; NB],
        out: &mut [f64; NV],
    ) {
        let g = model.scene.ice.gravity;
        let nb = model.bodies.len().min(NB);
        let mut f = [Vector3::zeros(); NB];
        let mut n = [Vector3::zeros(); NB];
        for b in 0..nb {
            let (m, h, J) = (model.bodies[b].mass, &self.h[b], &self.J[b]);
            let (w, v, a, dw) = (&kin.w[b], &kin.v[b], &a[b], &dw[b]);
            // Acceleration of the point that is at O now: a + w x v (Featherstone 2008, eq. 2.48).
            if b < model.n_planar {
                let (w, dw) = (w.x, dw.x);
                let (ay, az) = (a.y - w * v.z, a.z + g + w * v.y);
                f[b].y = m * ay - dw * h.z - w * w * h.y;
                f[b].z = m * az + dw * h.y - w * w * h.z;
                n[b].x = J.xx * dw + h.y * az - h.z * ay;
            } else {
                let acc = a + Vector3::new(0.0, 0.0, g) + w.cross(v);
                f[b] = acc * m + dw.cross(h) + w.cross(&w.cross(h));
                n[b] = J.times(dw) + w.cross(&J.times(w)) + h.cross(&acc);
            }
        }
        for b in (0..nb).rev() {
            out[coordinate(b)] = kin.along(model, b, &f[b], &n[b]);
            if b > 0 {
                let up = model.bodies[b].parent;
                let (fb, nb) = (f[b], n[b]);
                f[up] += fb;
                n[up] += nb;
            }
        }
        out[0] = f[0].y;
        out[1] = f[0].z;
    }

    /// Inverse dynamics tau = M(q) q'' + h(q, q') + g(q); needs `Kinematics::velocities`.
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
        // What q'' adds to a body it adds to all bodies that it carries.
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

    /// Kinetic energy and potential energy above height `z0` of O [J].
    pub fn energy(&self, model: &Model, kin: &Kinematics, z0: f64) -> (f64, f64) {
        let mut kinetic = 0.0;
        let mut moment = 0.0;
        for (b, body) in model.bodies.iter().enumerate() {
            let (h, w, v) = (&self.h[b], &kin.w[b], &kin.v[b]);
            kinetic += 0.5 * body.mass * v.norm_squared() + v.dot(&w.cross(h));
            kinetic += if b < model.n_planar {
                0.5 * self.J[b].xx * w.x * w.x
            } else {
                0.5 * w.dot(&self.J[b].times(w))
            };
            moment += h.z + body.mass * z0;
        }
        (kinetic, model.scene.ice.gravity * moment)
    }

    /// Linear momentum, and the sagittal part of the angular momentum about O [kg m/s], [kg m2/s].
    pub fn momentum(&self, model: &Model, kin: &Kinematics) -> ([f64; 2], f64) {
        let (mut p, mut l) = ([0.0; 2], 0.0);
        for (b, body) in model.bodies.iter().enumerate() {
            let (h, w, v) = (&self.h[b], &kin.w[b], &kin.v[b]);
            let linear = v * body.mass + w.cross(h);
            p[0] += linear.y;
            p[1] += linear.z;
            l += h.y * v.z - h.z * v.y;
            l += if b < model.n_planar {
                self.J[b].xx * w.x
            } else {
                self.J[b].times(w).x
            };
        }
        (p, l)
    }
}

/// Generalised force of a force `f` at a point (from O) of a body, along the coordinates of its
/// path: out += J^T f. `from` skips the first coordinates of the path (the root: `ROOT`).
pub fn add_point_force(
    model: &Model,
    kin: &Kinematics,
    (body, point): (usize, &Vector3<f64>),
    f: &Vector3<f64>,
    from: usize,
    out: &mut [f64; NV],
) {
    let n = point.cross(f);
    let c = coordinate(body);
    if from == 0 {
        out[0] += f.y;
        out[1] += f.z;
    }
    let depth = model.depth[c];
    for &a in &model.ancestors[c][from.max(2)..depth] {
        out[a] += kin.along(model, a - 2, f, &n);
    }
    out[c] += kin.along(model, body, f, &n);
    debug_assert!(from == 0 || from >= ROOT);
}
