//! Derivatives of inverse dynamics by positions and velocities (Singh, Russo and Wensing 2022, eqs. 31 to 34), in
//! world axes about the pivot O.
//!
//! With the composite inertia I, force f and Coriolis matrix B of the bodies that joint i carries, and j an ancestor
//! of i or i itself,
//!
//! ```text
//! d tau_i / d q_j = S_i . (2 B S'_j + I S''_j)        d tau_i / d v_j = 2 S_i . (B S_j + I S'_j)
//! d tau_j / d q_i = S_j . (2 B S'_i + I S''_i + S_i x* f)   d tau_j / d v_i = 2 S_j . (B S_i + I S'_i)
//! S'_j = v x S_j,  S''_j = a x S_j + v x S'_j         (v, a: velocity and acceleration of the parent of j)
//! ```
//!
//! B of a body acts on the angular part alone: its force is w x p, p being the momentum, and its moment is K w.

use crate::{
    dynamics::{crba_rnea::Inertias, kinematics::Kinematics},
    model::{
        Model,
        layout::{NV, ROOT, coordinate},
    },
    numeric::{
        simd::with_avx2,
        twist::{Twist, Wrench},
    },
};
use nalgebra::{Matrix3, Vector3};

/// Workspace and results.
#[derive(Debug, Clone, Default)]
pub struct RneaDerivatives {
    /// d tau / d q and d tau / d v, by row. The columns of y0 and z0 are zero.
    pub by_q: [[f64; NV]; NV],
    pub by_v: [[f64; NV]; NV],
    /// S, S' and S'' by coordinate.
    pub axis: [Twist; NV],
    rate: [Twist; NV],
    second: [Twist; NV],
    /// Velocity of the body that a coordinate moves, and its acceleration minus gravity.
    pub velocity: [Twist; NV],
    acceleration: [Twist; NV],
    composite: [Composite; NV],
}

/// Bodies that a joint carries.
#[derive(Debug, Clone, Copy, Default)]
struct Composite {
    mass: f64,
    h: Vector3<f64>,
    J: Matrix3<f64>,
    /// Linear momentum.
    p: Vector3<f64>,
    K: Matrix3<f64>,
    force: Wrench,
}

impl Composite {
    /// I m
    #[inline(always)]
    fn inertia(&self, m: &Twist) -> Wrench {
        Wrench {
            n: self.J * m.w + self.h.cross(&m.v),
            f: m.v * self.mass + m.w.cross(&self.h),
        }
    }

    /// B m
    #[inline(always)]
    fn coriolis(&self, m: &Twist) -> Wrench {
        Wrench {
            n: self.K * m.w,
            f: m.w.cross(&self.p),
        }
    }

    /// `body` in the sagittal plane: the matrices have only the entries for rotations about x.
    #[inline(always)]
    fn planar(mass: f64, h: Vector3<f64>, J: Matrix3<f64>, (v, a): (&Twist, &Twist)) -> Self {
        let mut body = Self {
            mass,
            h,
            J,
            ..Self::default()
        };
        let force = |m: &Twist| {
            let [y, z] = [m.v.y * mass - m.w.x * h.z, m.v.z * mass + m.w.x * h.y];
            let n = J.m11 * m.w.x + h.y * m.v.z - h.z * m.v.y;
            [n, y, z]
        };
        let ([_, py, pz], [n, y, z]) = (force(v), force(a));
        body.p = Vector3::new(0.0, py, pz);
        body.force.n.x = n + v.v.y * pz - v.v.z * py;
        (body.force.f.y, body.force.f.z) = (y - v.w.x * pz, z + v.w.x * py);
        body.K.m11 = h.y * v.v.y + h.z * v.v.z;
        body
    }

    /// A body with the velocity `v` and the acceleration `a`.
    #[inline(always)]
    fn body(mass: f64, h: Vector3<f64>, J: Matrix3<f64>, (v, a): (&Twist, &Twist)) -> Self {
        let mut body = Self {
            mass,
            h,
            J,
            ..Self::default()
        };
        let momentum = body.inertia(v);
        body.p = momentum.f;
        body.force = body.inertia(a).add_scaled(&v.cross_force(&momentum), 1.0);
        // K w = (E w) x w_body + h x (w x v) with the second moment E.
        let E = Matrix3::from_diagonal_element(0.5 * J.trace()) - J;
        let along = h.dot(&v.v);
        for j in 0..3 {
            let column = E.column(j).cross(&v.w) - v.v * h[j];
            for i in 0..3 {
                body.K[(i, j)] = column[i] + if i == j { along } else { 0.0 };
            }
        }
        body
    }

    #[inline(always)]
    fn add(&mut self, other: &Self) {
        self.mass += other.mass;
        self.h += other.h;
        self.J += other.J;
        self.p += other.p;
        self.K += other.K;
        self.force = self.force.add_scaled(&other.force, 1.0);
    }
}

impl RneaDerivatives {
    /// Derivatives at the velocities `v` and the accelerations `qdd`, under the gravity `g`. Needs
    /// `Kinematics::positions` and `Inertias::update`.
    pub fn update(
        &mut self,
        model: &Model,
        (kin, inertias): (&Kinematics, &Inertias),
        (v, qdd, g): (&[f64; NV], &[f64; NV], f64),
    ) {
        with_avx2(
            #[inline(always)]
            || {
                self.update_motions(model, kin, (v, qdd, g));
                self.update_joints(model, inertias);
            },
        );
    }

    #[inline(always)]
    fn update_joints(&mut self, model: &Model, inertias: &Inertias) {
        for c in 2..model.n {
            let b = c - 2;
            let (h, J) = inertias.body(b);
            let motion = (&self.velocity[c], &self.acceleration[c]);
            let mass = model.bodies[b].mass;
            self.composite[c] = match b < model.n_planar {
                true => Composite::planar(mass, h, J, motion),
                false => Composite::body(mass, h, J, motion),
            };
        }
        for c in (2..model.n).rev() {
            self.update_joint(model, c);
            if c > 2 {
                let carried = self.composite[c];
                self.composite[coordinate(model.parent[c - 2])].add(&carried);
            }
        }
    }

    /// Axes, velocities and accelerations.
    #[inline(always)]
    fn update_motions(
        &mut self,
        model: &Model,
        kin: &Kinematics,
        (v, qdd, g): (&[f64; NV], &[f64; NV], f64),
    ) {
        let still = Twist::default();
        let falling = Twist {
            v: Vector3::new(0.0, 0.0, g),
            ..still
        };
        let mut up = (still, falling);
        for c in 0..model.n {
            if c >= ROOT {
                let parent = coordinate(model.parent[c - 2]);
                up = (self.velocity[parent], self.acceleration[parent]);
            }
            let axis = kin.joint_axis(model, c);
            let rate = up.0.cross(&axis);
            let second = up.1.cross(&axis);
            let turned = up.0.cross(&rate);
            self.second[c] = second.add_scaled(&turned, 1.0);
            (self.axis[c], self.rate[c]) = (axis, rate);
            up = (
                up.0.add_scaled(&axis, v[c]),
                up.1.add_scaled(&axis, qdd[c]).add_scaled(&rate, v[c]),
            );
            (self.velocity[c], self.acceleration[c]) = up;
        }
    }

    /// Derivatives between joint `i` and its ancestors.
    #[inline(always)]
    fn update_joint(&mut self, model: &Model, i: usize) {
        let body = &self.composite[i];
        let (axis, rate, second) = (&self.axis[i], &self.rate[i], &self.second[i]);
        let momentum = body.inertia(axis);
        let by_q = body.inertia(second);
        let by_q = by_q.add_scaled(&body.coriolis(rate), 2.0);
        let by_q = by_q.add_scaled(&axis.cross_force(&body.force), 1.0);
        let by_v = body.inertia(rate).add_scaled(&body.coriolis(axis), 1.0);
        // S_i . 2 B m = turning . m.w
        let turning = (body.K.tr_mul(&axis.w) + body.p.cross(&axis.v)) * 2.0;
        let depth = model.depth[i].min(model.ancestors[i].len());
        let last_planar = coordinate(model.n_planar);
        for &j in model.ancestors[i][..depth].iter().chain(&[i]) {
            let (axis, rate, second) = (&self.axis[j], &self.rate[j], &self.second[j]);
            let (lower, upper) = if j < last_planar {
                // S' and S'' have no angular part.
                let along = |m: &Twist| m.v.y * momentum.f.y + m.v.z * momentum.f.z;
                let power = |f: &Wrench| axis.w.x * f.n.x + axis.v.y * f.f.y + axis.v.z * f.f.z;
                let by_v_lower = turning.x * axis.w.x + 2.0 * along(rate);
                ([along(second), by_v_lower], [power(&by_q), power(&by_v)])
            } else {
                let by_q_lower = turning.dot(&rate.w) + second.dot(&momentum);
                let by_v_lower = turning.dot(&axis.w) + 2.0 * rate.dot(&momentum);
                ([by_q_lower, by_v_lower], [axis.dot(&by_q), axis.dot(&by_v)])
            };
            if j >= 2 {
                [self.by_q[i][j], self.by_v[i][j]] = lower;
            }
            if j != i {
                [self.by_q[j][i], self.by_v[j][i]] = [upper[0], 2.0 * upper[1]];
            }
        }
    }
}
