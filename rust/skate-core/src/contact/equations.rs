//! The contact equations: Eq. 13 with the joints eliminated.
//!
//! What remains are the three equations of the root, the supporting foot's pivot, and one row for each
//! constraint of the free foot:
//!
//! ```text
//! S a_r = b + f_r + G^T lam          (articulated inertia at the pivot; y0, z0, q1)
//! a_f   = G a_r + W lam + alpha0     (free foot's contact point; y, z, rotation)
//! ```
//!
//! A contact mode determines which components of (a_r, f_r) and (a_f, lam) are zero, and the sliding
//! friction f_y = -mu sign(v_y) f_z (Eq. 11). The unknowns are those of Table 2. With velocities in place of
//! accelerations and impulses in place of forces the same equations describe an impact.

use crate::{
    contact::elimination::{Equations, eliminate},
    model::{
        contact_mode::{ContactMode, Foot, SUPPORT, SoleContact},
        lanes::ModelLanes,
    },
    numeric::{scalar::Scalar, vec3},
};
use nalgebra::{Matrix3, Vector3};

/// Components of the motion of a foot and of the force on it.
pub const Y: usize = 0;
pub const Z: usize = 1;
pub const PHI: usize = 2;
/// Largest number of unknowns: three coordinates of the root and three multipliers.
pub(super) const MAX_UNKNOWNS: usize = 6;

/// A pivot smaller than this times its scale may be zero: four digits of the force that it determines are
/// left.
pub(super) const DEPENDENT: f64 = 1e-11;

/// See the module's documentation.
#[derive(Debug, Clone, Copy)]
pub struct ContactProblem<T: Scalar = f64> {
    /// Articulated inertia of the robot at the pivot.
    pub S: Matrix3<T>,
    /// Applied force (or momentum), reduced to the pivot.
    pub b: Vector3<T>,
    /// Motion of the free foot's contact point per motion of the root, without joint torques.
    pub G: Matrix3<T>,
    /// Inverse inertia at that point with the root fixed.
    pub W: Matrix3<T>,
    /// Motion of that point without contact forces and with the root at rest.
    pub alpha0: Vector3<T>,
    /// Distances from heel to toe of both feet along y; negative for a foot that is upside down [m].
    pub lever: [T; 2],
}

impl<T: Scalar> Default for ContactProblem<T> {
    fn default() -> Self {
        let (matrix, vector) = (vec3::zeros(), vec3::zero());
        Self {
            S: matrix,
            b: vector,
            G: matrix,
            W: matrix,
            alpha0: vector,
            lever: [T::zero(); 2],
        }
    }
}

/// Motion of both feet at their contact points (y, z, rotation) and forces on them (f_y, f_z, couple).
#[derive(Debug, Clone, Copy)]
pub struct Solution<T: Scalar = f64> {
    pub a_root: Vector3<T>,
    pub f_root: Vector3<T>,
    pub a_free: Vector3<T>,
    pub lam: Vector3<T>,
}

impl<T: Scalar> Default for Solution<T> {
    #[inline(always)]
    fn default() -> Self {
        let zero = vec3::zero();
        Self {
            a_root: zero,
            f_root: zero,
            a_free: zero,
            lam: zero,
        }
    }
}

/// Signed friction coefficients mu sign(v_y) of both feet; zero where a foot sticks or is pulled.
#[derive(Debug, Clone, Copy, Default)]
pub struct Slip<T = f64> {
    pub support: T,
    pub free: T,
}

impl Slip {
    /// The same in every lane.
    #[inline(always)]
    pub fn broadcast<T: Scalar>(self) -> Slip<T> {
        Slip {
            support: T::of(self.support),
            free: T::of(self.free),
        }
    }
}

impl<T: Scalar> Slip<T> {
    #[inline(always)]
    pub fn of(models: impl ModelLanes<T>, mode: ContactMode) -> Self {
        let ratio =
            |foot: Foot| models.number(|m| m.friction.ratio(foot.friction_mode, foot.pulled));
        Self {
            support: ratio(mode.support),
            free: ratio(mode.free),
        }
    }
}

impl Solution {
    /// Normal force on a foot [N].
    pub fn normal_force(&self, which: usize) -> f64 {
        if which == SUPPORT {
            self.f_root[Z]
        } else {
            self.lam[Z]
        }
    }
}

impl<T: Scalar> Solution<T> {
    /// Set one lane.
    #[inline(always)]
    pub fn set_lane(&mut self, lane: usize, from: &Solution) {
        for i in 0..3 {
            self.a_root[i].set_lane(lane, from.a_root[i]);
            self.f_root[i].set_lane(lane, from.f_root[i]);
            self.a_free[i].set_lane(lane, from.a_free[i]);
            self.lam[i].set_lane(lane, from.lam[i]);
        }
    }

    /// Copy one lane to `to`, number by number: loading a whole vector that was just assembled from parts
    /// would stall.
    #[inline(always)]
    pub fn lane_to(&self, lane: usize, to: &mut Solution) {
        for i in 0..3 {
            to.a_root[i] = self.a_root[i].lane(lane);
            to.f_root[i] = self.f_root[i].lane(lane);
            to.a_free[i] = self.a_free[i].lane(lane);
            to.lam[i] = self.lam[i].lane(lane);
        }
    }
}

impl<T: Scalar> ContactProblem<T> {
    /// The problem of one lane.
    pub fn lane(&self, lane: usize) -> ContactProblem {
        ContactProblem {
            S: self.S.map(|x| x.lane(lane)),
            b: self.b.map(|x| x.lane(lane)),
            G: self.G.map(|x| x.lane(lane)),
            W: self.W.map(|x| x.lane(lane)),
            alpha0: self.alpha0.map(|x| x.lane(lane)),
            lever: self.lever.map(|x| x.lane(lane)),
        }
    }

    /// The same problem with other loads.
    #[inline(always)]
    pub fn with_loads(&self, b: Vector3<T>, alpha0: Vector3<T>) -> Self {
        Self { b, alpha0, ..*self }
    }

    /// Solution for the given mode; the mask holds where the mode determines motion and forces.
    #[inline(always)]
    pub fn regular(&self, mode: ContactMode, slip: Slip<T>) -> (Solution<T>, T::Mask) {
        let (mut solution, regular) = self.regular_forces(mode, slip);
        solution.a_free = self.free_motion(&solution);
        (solution, regular)
    }

    /// `regular` without the motion of the free foot.
    #[inline(always)]
    pub fn regular_forces(&self, mode: ContactMode, slip: Slip<T>) -> (Solution<T>, T::Mask) {
        T::in_one_function(
            #[inline(always)]
            || {
                // Few unknowns stay in registers.
                let (root, multipliers) = unknowns(mode);
                match root + multipliers {
                    0 | 1 => self.regular_within::<1>(mode, slip),
                    2 => self.regular_within::<2>(mode, slip),
                    3 => self.regular_within::<3>(mode, slip),
                    4 => self.regular_within::<4>(mode, slip),
                    _ => self.regular_within::<MAX_UNKNOWNS>(mode, slip),
                }
            },
        )
    }

    #[inline(always)]
    fn regular_within<const N: usize>(
        &self,
        mode: ContactMode,
        slip: Slip<T>,
    ) -> (Solution<T>, T::Mask) {
        let (root, n_root) = root_unknowns(mode.support);
        let (held, n_held) = multipliers(mode.free);
        let scale = (n_root, self.mobility(n_held));
        let equations = self.equations::<N>(mode, slip);
        let (x, outcome) = eliminate(equations, n_root + n_held, scale, T::of(DEPENDENT));
        let components = (&root[..n_root], &held[..n_held]);
        (
            self.solution(components, (mode, slip), &x),
            outcome.solved(),
        )
    }

    /// Largest inverse inertia of the free foot's point; 0 without multipliers [1/kg].
    #[inline(always)]
    pub(super) fn mobility(&self, n_held: usize) -> T {
        let mut mobility = T::zero();
        if n_held > 0 {
            for i in 0..2 {
                for j in 0..2 {
                    mobility = self.W[(i, j)].abs().simd_max(mobility);
                }
            }
        }
        mobility
    }

    /// Motion of the free foot's point.
    #[inline(always)]
    pub fn free_motion(&self, solution: &Solution<T>) -> Vector3<T> {
        let by_root = vec3::apply(&self.G, &solution.a_root);
        let by_forces = vec3::apply(&self.W, &solution.lam);
        vec3::add(&vec3::add(&by_root, &by_forces), &self.alpha0)
    }

    /// Motion of the supporting foot and forces on both from the unknowns `x`, root coordinates first.
    #[inline(always)]
    pub(super) fn solution(
        &self,
        (root, held): (&[usize], &[usize]),
        (mode, slip): (ContactMode, Slip<T>),
        x: &[T],
    ) -> Solution<T> {
        let [mut a_root, mut lam] = [vec3::zero(); 2];
        for (&r, x) in root.iter().zip(x) {
            a_root[r] = *x;
        }
        for (&m, x) in held.iter().zip(&x[root.len()..]) {
            lam[m] = *x;
        }
        if !held.is_empty() && mode.free.slides() {
            lam[Y] = -slip.free * lam[Z];
        }
        let mut f_root = vec3::sub(&vec3::apply(&self.S, &a_root), &self.b);
        if !held.is_empty() {
            let from_free_foot = vec3::apply_transposed(&self.G, &lam);
            f_root = vec3::sub(&f_root, &from_free_foot);
        }
        let a_free = vec3::zero();
        Solution {
            a_root,
            f_root,
            a_free,
            lam,
        }
    }

    /// Component `k` of the force on the root per unit of multiplier `m`; f_z includes its friction.
    #[inline(always)]
    fn root_force(&self, m: usize, k: usize, slip: Slip<T>) -> T {
        if m == Z {
            self.G[(m, k)] - self.G[(Y, k)] * slip.free
        } else {
            self.G[(m, k)]
        }
    }

    /// Rows and columns of the unknown root coordinates, then of the free foot's multipliers.
    #[inline(always)]
    pub(super) fn equations<const N: usize>(
        &self,
        mode: ContactMode,
        slip: Slip<T>,
    ) -> Equations<T, N> {
        let (root, n_root) = root_unknowns(mode.support);
        let (held, n_held) = multipliers(mode.free);
        let (mut A, mut b) = ([[T::zero(); N]; N], [T::zero(); N]);
        for (i, &r) in root[..n_root].iter().enumerate() {
            // Sliding support: f_y + ratio f_z = 0 in place of f_y = 0.
            let ratio = if r == Y { slip.support } else { T::zero() };
            for (j, &k) in root[..n_root].iter().enumerate() {
                A[i][j] = self.S[(r, k)] + ratio * self.S[(Z, k)];
            }
            for (j, &m) in held[..n_held].iter().enumerate() {
                A[i][n_root + j] =
                    -(self.root_force(m, r, slip) + ratio * self.root_force(m, Z, slip));
            }
            b[i] = self.b[r] + ratio * self.b[Z];
        }
        for (i, &m) in held[..n_held].iter().enumerate() {
            for (j, &k) in root[..n_root].iter().enumerate() {
                A[n_root + i][j] = self.G[(m, k)];
            }
            for (j, &l) in held[..n_held].iter().enumerate() {
                let friction = if l == Z {
                    slip.free * self.W[(m, Y)]
                } else {
                    T::zero()
                };
                A[n_root + i][n_root + j] = self.W[(m, l)] - friction;
            }
            b[n_root + i] = -self.alpha0[m];
        }
        (A, b)
    }
}

/// Numbers of unknown root coordinates and of unknown multipliers of a mode (Table 2).
pub fn unknowns(mode: ContactMode) -> (usize, usize) {
    (root_unknowns(mode.support).1, multipliers(mode.free).1)
}

/// Root coordinates that the mode leaves free, and their number.
pub fn root_unknowns(support: Foot) -> ([usize; 3], usize) {
    match (support.touch, support.slides()) {
        (SoleContact::Air, _) => ([Y, Z, PHI], 3),
        (SoleContact::Flat, false) => ([0; 3], 0),
        (SoleContact::Flat, true) => ([Y, 0, 0], 1),
        (_, false) => ([PHI, 0, 0], 1),
        (_, true) => ([Y, PHI, 0], 2),
    }
}

/// Components of the free foot's motion that the mode constrains, each with a multiplier, and their number.
/// With straight legs only rounding determines the multiplier of Z. It comes last, so that the last pivot
/// shows that.
pub fn multipliers(free: Foot) -> ([usize; 3], usize) {
    match (free.touch, free.slides()) {
        (SoleContact::Air, _) => ([0; 3], 0),
        (SoleContact::Flat, false) => ([PHI, Y, Z], 3),
        (SoleContact::Flat, true) => ([PHI, Z, 0], 2),
        (_, false) => ([Y, Z, 0], 2),
        (_, true) => ([Z, 0, 0], 1),
    }
}
