//! The contact forces of both feet from one factor of the inertia matrix.
//!
//! Eliminating the joints leaves the three root equations of the supporting foot and, for every
//! constraint of the free foot, one row more:
//!
//! ```text
//! S a_r = b + f_r + G^T lam          (articulated inertia at the pivot; y0, z0, q1)
//! a_f   = G a_r + W lam + alpha0     (free foot's contact point; y, z, rotation)
//! ```
//!
//! A contact mode says which components of (a_r, f_r) and (a_f, lam) are zero and ties sliding
//! friction to its normal force, f_y = -mu sign(v_y) f_z: Eq. 13 with only the unknowns that Table 2
//! gives the state. With accelerations replaced by velocities and forces by impulses the same
//! equations are those of an impact.

use super::mode::{Foot, Mode, Touch};
use crate::error::EndCause;
use nalgebra::{Matrix3, Vector3};

/// Components of a foot's motion and force.
pub const Y: usize = 0;
pub const Z: usize = 1;
pub const PHI: usize = 2;
/// Two of the root's three coordinates and three multipliers: state 20.
const MOST: usize = 6;

/// See the module's documentation.
#[derive(Debug, Clone, Copy, Default)]
pub struct ContactProblem {
    /// Articulated inertia of the robot at the pivot.
    pub S: Matrix3<f64>,
    /// Reduced applied force (or momentum) at the pivot.
    pub b: Vector3<f64>,
    /// Motion of the free foot's contact point per motion of the root, joints slack.
    pub G: Matrix3<f64>,
    /// Inverse inertia felt at that point with the root held.
    pub W: Matrix3<f64>,
    /// Motion of that point without contact forces, root at rest.
    pub alpha0: Vector3<f64>,
}

/// Motion and force of both feet at their contact points; (y, z, rotation) and (f_y, f_z, couple).
#[derive(Debug, Clone, Copy, Default)]
pub struct Solution {
    pub a_root: Vector3<f64>,
    pub f_root: Vector3<f64>,
    pub a_free: Vector3<f64>,
    pub lam: Vector3<f64>,
}

/// Signed coefficients mu sign(v) of the two feet; zero where a foot sticks or is pulled.
#[derive(Debug, Clone, Copy, Default)]
pub struct Slip {
    pub support: f64,
    pub free: f64,
}

impl ContactProblem {
    /// Solve for the given mode.
    ///
    /// # Errors
    /// `Singular` when the unknowns are not determined.
    pub fn solve(&self, mode: Mode, slip: Slip) -> Result<Solution, EndCause> {
        let (live, n_live) = live_components(mode.support);
        let (held, n_held) = held_components(mode.free);
        let n = n_live + n_held;
        let x = match eliminate(&mut self.equations(mode, slip), n) {
            Err(EndCause::Singular) if n_held > 0 => {
                proximal(&self.equations(mode, slip), n_live, n)?
            }
            solved => solved?,
        };
        let mut solution = Solution::default();
        for (i, &r) in live[..n_live].iter().enumerate() {
            solution.a_root[r] = x[i];
        }
        for (i, &m) in held[..n_held].iter().enumerate() {
            solution.lam[m] = x[n_live + i];
        }
        if n_held > 0 && mode.free.slides() {
            solution.lam[Y] = -slip.free * solution.lam[Z];
        }
        solution.f_root = self.S * solution.a_root - self.b;
        if n_held > 0 {
            solution.f_root -= self.G.transpose() * solution.lam;
        }
        solution.a_free = self.G * solution.a_root + self.W * solution.lam + self.alpha0;
        Ok(solution)
    }

    /// Rows and columns of the free root coordinates, then of the free foot's multipliers.
    fn equations(&self, mode: Mode, slip: Slip) -> [[f64; MOST + 1]; MOST] {
        let (live, n_live) = live_components(mode.support);
        let (held, n_held) = held_components(mode.free);
        // Forces along the held components: f_z brings its friction along.
        let column = |m: usize| {
            let g = self.G.row(m).transpose();
            if m == Z {
                g - self.G.row(Y).transpose() * slip.free
            } else {
                g
            }
        };
        let mut A = [[0.0; MOST + 1]; MOST];
        for (i, &r) in live[..n_live].iter().enumerate() {
            // Sliding support: f_y + mu s f_z = 0 instead of f_y = 0.
            let tie = if r == Y { slip.support } else { 0.0 };
            for (j, &k) in live[..n_live].iter().enumerate() {
                A[i][j] = self.S[(r, k)] + tie * self.S[(Z, k)];
            }
            for (j, &m) in held[..n_held].iter().enumerate() {
                let c = column(m);
                A[i][n_live + j] = -(c[r] + tie * c[Z]);
            }
            A[i][MOST] = self.b[r] + tie * self.b[Z];
        }
        for (i, &m) in held[..n_held].iter().enumerate() {
            for (j, &k) in live[..n_live].iter().enumerate() {
                A[n_live + i][j] = self.G[(m, k)];
            }
            for (j, &l) in held[..n_held].iter().enumerate() {
                let friction = if l == Z {
                    slip.free * self.W[(m, Y)]
                } else {
                    0.0
                };
                A[n_live + i][n_live + j] = self.W[(m, l)] - friction;
            }
            A[n_live + i][MOST] = -self.alpha0[m];
        }
        A
    }

    /// The same problem with the pivot moved by `dy` along a flat supporting foot.
    pub fn with_pivot_moved(&self, dy: f64) -> Self {
        // Motion at the old pivot from the motion at the new one: z loses dy times the rotation.
        let mut X = Matrix3::identity();
        X[(Z, PHI)] = -dy;
        Self {
            S: X.transpose() * self.S * X,
            b: X.transpose() * self.b,
            G: self.G * X,
            ..*self
        }
    }

    /// The same problem with the free foot's contact point moved by `dy` along its flat sole.
    pub fn with_free_point_moved(&self, dy: f64) -> Self {
        let mut X = Matrix3::identity();
        X[(Z, PHI)] = dy;
        Self {
            G: X * self.G,
            W: X * self.W * X.transpose(),
            alpha0: X * self.alpha0,
            ..*self
        }
    }
}

/// Unknown accelerations of the root and unknown multipliers of a mode, Table 2.
pub fn unknowns(mode: Mode) -> (usize, usize) {
    (
        live_components(mode.support).1,
        held_components(mode.free).1,
    )
}

/// Root coordinates that the mode leaves free, and their number.
fn live_components(support: Foot) -> ([usize; 3], usize) {
    match (support.touch, support.slides()) {
        (Touch::Air, _) => ([Y, Z, PHI], 3),
        (Touch::Flat, false) => ([0; 3], 0),
        (Touch::Flat, true) => ([Y, 0, 0], 1),
        (_, false) => ([PHI, 0, 0], 1),
        (_, true) => ([Y, PHI, 0], 2),
    }
}

/// Components of the free foot's motion that the mode holds, and their number.
fn held_components(free: Foot) -> ([usize; 3], usize) {
    match (free.touch, free.slides()) {
        (Touch::Air, _) => ([0; 3], 0),
        (Touch::Flat, false) => ([Z, PHI, Y], 3),
        (Touch::Flat, true) => ([Z, PHI, 0], 2),
        (_, false) => ([Z, Y, 0], 2),
        (_, true) => ([Z, 0, 0], 1),
    }
}

/// Forces where constraints depend on each other, as under two straight legs: the least ones, by
/// proximal iterations (Rockafellar 1976). `A` is as for `eliminate`; multipliers start at `from`.
fn proximal(A: &[[f64; MOST + 1]; MOST], from: usize, n: usize) -> Result<[f64; MOST], EndCause> {
    let scale = (0..n).fold(f64::MIN_POSITIVE, |top, i| top.max(A[i][i].abs()));
    let load = (0..n).fold(f64::MIN_POSITIVE, |top, i| top.max(A[i][MOST].abs()));
    let weight = 1e-6 * scale;
    let mut x = [0.0; MOST];
    for _ in 0..PROXIMAL_ITERATIONS {
        let mut B = *A;
        for i in from..n {
            B[i][i] += weight;
            B[i][MOST] += weight * x[i];
        }
        x = eliminate(&mut B, n)?;
        let residual = (0..n).fold(0.0_f64, |top, i| {
            let sum: f64 = (0..n).map(|j| A[i][j] * x[j]).sum();
            top.max((sum - A[i][MOST]).abs())
        });
        if residual <= 1e-12 * load {
            return Ok(x);
        }
    }
    Err(EndCause::Singular)
}

/// Consistent constraints need two or three; others never end.
const PROXIMAL_ITERATIONS: usize = 10;

/// A pivot this much smaller than its column counts as zero; rounding leaves about 1e-16.
const RANK_TOLERANCE: f64 = 1e-14;

/// Gauss with row pivoting; the right-hand side stands in column `MOST`.
fn eliminate(A: &mut [[f64; MOST + 1]; MOST], n: usize) -> Result<[f64; MOST], EndCause> {
    let n = n.min(MOST);
    let mut x = [0.0; MOST];
    let mut scale = [0.0_f64; MOST];
    for row in &A[..n] {
        for k in 0..n {
            scale[k] = scale[k].max(row[k].abs());
        }
    }
    for k in 0..n {
        let mut pivot = k;
        for i in k + 1..n {
            if A[i][k].abs() >= A[pivot][k].abs() {
                pivot = i;
            }
        }
        if pivot != k {
            A.swap(k, pivot);
        }
        let d = A[k][k];
        if d.is_nan() {
            return Err(EndCause::NotFinite);
        }
        if d.abs() <= RANK_TOLERANCE * scale[k] {
            return Err(EndCause::Singular);
        }
        for i in k + 1..n {
            let factor = A[i][k] / d;
            for j in k + 1..n {
                A[i][j] -= factor * A[k][j];
            }
            A[i][MOST] -= factor * A[k][MOST];
        }
    }
    for k in (0..n).rev() {
        let mut value = A[k][MOST];
        for j in k + 1..n {
            value -= A[k][j] * x[j];
        }
        x[k] = value / A[k][k];
    }
    Ok(x)
}
