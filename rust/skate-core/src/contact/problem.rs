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
    /// Solve for the given mode. Where constraints (almost) depend on each other, as under two straight
    /// legs, no force is larger than what they ask for consistently; what no force can do is left undone.
    ///
    /// # Errors
    /// `Singular` when the root's motion is not determined.
    pub fn solve(&self, mode: Mode, slip: Slip) -> Result<Solution, EndCause> {
        let (live, n_live) = live_components(mode.support);
        let (held, n_held) = held_components(mode.free);
        let (n, felt) = (n_live + n_held, self.felt(n_held));
        let x = match eliminate(
            &mut self.equations(mode, slip),
            n,
            (n_live, felt),
            DEPENDENT,
        ) {
            Err(EndCause::Singular) if n_held > 0 => {
                let A = self.equations(mode, slip);
                proximal(&A, n, (n_live, felt), self.half(&held[..n_held]))?
            }
            solved => solved?,
        };
        Ok(self.solution((&live[..n_live], &held[..n_held]), (mode, slip), &x))
    }

    /// Multipliers with which the free foot takes half of the load: where nothing else decides, the sum of
    /// the squares of both feet's forces is least there.
    fn half(&self, held: &[usize]) -> [f64; 3] {
        let mut half = [0.0; 3];
        for (half, &m) in half.iter_mut().zip(held) {
            *half = if m == PHI { 0.0 } else { -0.5 * self.b[m] };
        }
        half
    }

    /// How much the free foot's point gives way to forces on it [1/kg].
    fn felt(&self, n_held: usize) -> f64 {
        match n_held {
            0 => 0.0,
            _ => self.W.fixed_view::<2, 2>(0, 0).amax(),
        }
    }

    /// Motion and forces of both feet from the unknowns `x`, root coordinates first.
    fn solution(
        &self,
        (live, held): (&[usize], &[usize]),
        (mode, slip): (Mode, Slip),
        x: &[f64; MOST],
    ) -> Solution {
        let mut solution = Solution::default();
        for (&r, x) in live.iter().zip(x) {
            solution.a_root[r] = *x;
        }
        for (&m, x) in held.iter().zip(&x[live.len()..]) {
            solution.lam[m] = *x;
        }
        if !held.is_empty() && mode.free.slides() {
            solution.lam[Y] = -slip.free * solution.lam[Z];
        }
        solution.f_root = self.S * solution.a_root - self.b;
        if !held.is_empty() {
            solution.f_root -= self.G.transpose() * solution.lam;
        }
        solution.a_free = self.G * solution.a_root + self.W * solution.lam + self.alpha0;
        solution
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

/// Components of the free foot's motion that the mode holds, and their number. Straight legs leave Z to
/// nothing but rounding: it comes last, so that its pivot says so.
fn held_components(free: Foot) -> ([usize; 3], usize) {
    match (free.touch, free.slides()) {
        (Touch::Air, _) => ([0; 3], 0),
        (Touch::Flat, false) => ([PHI, Y, Z], 3),
        (Touch::Flat, true) => ([PHI, Z, 0], 2),
        (_, false) => ([Y, Z, 0], 2),
        (_, true) => ([Z, 0, 0], 1),
    }
}

/// Forces where constraints (almost) depend on each other: those nearest to `start`, by proximal iterations
/// (Rockafellar 1976). `A` and `scale` are as for `eliminate`.
fn proximal(
    A: &[[f64; MOST + 1]; MOST],
    n: usize,
    scale: (usize, f64),
    start: [f64; 3],
) -> Result<[f64; MOST], EndCause> {
    let n = n.min(MOST);
    let from = scale.0;
    let weight = PROXIMAL * (from..n).fold(scale.1, |top, i| top.max(A[i][i].abs()));
    let (mut x, mut left) = ([0.0; MOST], f64::INFINITY);
    for (x, start) in x[from.min(n)..n].iter_mut().zip(start) {
        *x = start;
    }
    loop {
        let mut B = *A;
        for i in from..n {
            B[i][i] += weight;
            B[i][MOST] += weight * x[i];
        }
        let next = eliminate(&mut B, n, scale, 0.0)?;
        let residual = (0..n).fold(0.0_f64, |top, i| {
            let sum: f64 = (0..n).map(|j| A[i][j] * next[j]).sum();
            top.max((sum - A[i][MOST]).abs())
        });
        // What can be met is met in two or three; the rest never.
        if residual < 0.1 * left {
            (x, left) = (next, residual);
        } else {
            return Ok(x);
        }
    }
}

/// Weight of a proximal step, in shares of the largest mobility.
const PROXIMAL: f64 = 1e-6;
/// A pivot this much smaller than its scale may be zero: of the force it decides, four digits are left.
const DEPENDENT: f64 = 1e-11;
/// Gauss with row pivoting; the right-hand side stands in column `MOST`. `Singular` where a pivot is
/// less than `least` times its scale: the largest of its column or, for multipliers, which start at `from`,
/// `felt` if that is larger.
fn eliminate(
    A: &mut [[f64; MOST + 1]; MOST],
    n: usize,
    (from, felt): (usize, f64),
    least: f64,
) -> Result<[f64; MOST], EndCause> {
    let n = n.min(MOST);
    let mut x = [0.0; MOST];
    let mut scale = [0.0_f64; MOST];
    for k in from..n {
        scale[k] = felt;
    }
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
        if d.abs() <= least * scale[k] {
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
