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

use crate::{
    error::Termination,
    model::contact_mode::{ContactMode, Foot, SoleContact},
    numeric::{
        scalar::{Mask, Scalar},
        vec3,
    },
};
use nalgebra::{Matrix3, Vector3};

/// Components of a foot's motion and force.
pub const Y: usize = 0;
pub const Z: usize = 1;
pub const PHI: usize = 2;
/// Two of the root's three coordinates and three multipliers: state 20.
const MOST: usize = 6;

/// See the module's documentation.
#[derive(Debug, Clone, Copy)]
pub struct ContactProblem<T: Scalar = f64> {
    /// Articulated inertia of the robot at the pivot.
    pub S: Matrix3<T>,
    /// Reduced applied force (or momentum) at the pivot.
    pub b: Vector3<T>,
    /// Motion of the free foot's contact point per motion of the root, joints slack.
    pub G: Matrix3<T>,
    /// Inverse inertia felt at that point with the root held.
    pub W: Matrix3<T>,
    /// Motion of that point without contact forces, root at rest.
    pub alpha0: Vector3<T>,
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
        }
    }
}

/// Motion and force of both feet at their contact points; (y, z, rotation) and (f_y, f_z, couple).
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

/// Signed coefficients mu sign(v) of the two feet; zero where a foot sticks or is pulled.
#[derive(Debug, Clone, Copy, Default)]
pub struct Slip<T = f64> {
    pub support: T,
    pub free: T,
}

impl<T: Scalar> Solution<T> {
    /// Replace those of a lane.
    #[inline(always)]
    pub fn set_lane(&mut self, lane: usize, from: &Solution) {
        for i in 0..3 {
            self.a_root[i].set_lane(lane, from.a_root[i]);
            self.f_root[i].set_lane(lane, from.f_root[i]);
            self.a_free[i].set_lane(lane, from.a_free[i]);
            self.lam[i].set_lane(lane, from.lam[i]);
        }
    }

    /// Put those of a lane where they belong, number by number: a copy of what has just been put together
    /// would wait for it.
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
    /// That of a lane.
    pub fn lane(&self, lane: usize) -> ContactProblem {
        ContactProblem {
            S: self.S.map(|x| x.lane(lane)),
            b: self.b.map(|x| x.lane(lane)),
            G: self.G.map(|x| x.lane(lane)),
            W: self.W.map(|x| x.lane(lane)),
            alpha0: self.alpha0.map(|x| x.lane(lane)),
        }
    }

    /// Solve for the given mode where it determines motion and forces; the mask says where.
    #[inline(always)]
    pub fn regular(&self, mode: ContactMode, slip: Slip<T>) -> (Solution<T>, T::Mask) {
        // Most modes leave few unknowns, which then stay in registers.
        let (live, held) = unknowns(mode);
        match live + held {
            0 | 1 => self.regular_within::<1>(mode, slip),
            2 => self.regular_within::<2>(mode, slip),
            3 => self.regular_within::<3>(mode, slip),
            4 => self.regular_within::<4>(mode, slip),
            _ => self.regular_within::<MOST>(mode, slip),
        }
    }

    #[inline(always)]
    fn regular_within<const N: usize>(
        &self,
        mode: ContactMode,
        slip: Slip<T>,
    ) -> (Solution<T>, T::Mask) {
        let (live, n_live) = live_components(mode.support);
        let (held, n_held) = held_components(mode.free);
        let scale = (n_live, self.felt(n_held));
        let equations = self.equations::<N>(mode, slip);
        let (x, outcome) = eliminate(equations, n_live + n_held, scale, T::of(DEPENDENT));
        let parts = (&live[..n_live], &held[..n_held]);
        (self.solution(parts, (mode, slip), &x), outcome.solved())
    }

    /// How much the free foot's point gives way to forces on it [1/kg].
    #[inline(always)]
    fn felt(&self, n_held: usize) -> T {
        let mut felt = T::zero();
        if n_held > 0 {
            for i in 0..2 {
                for j in 0..2 {
                    felt = self.W[(i, j)].abs().simd_max(felt);
                }
            }
        }
        felt
    }

    /// Motion and forces of both feet from the unknowns `x`, root coordinates first.
    #[inline(always)]
    fn solution(
        &self,
        (live, held): (&[usize], &[usize]),
        (mode, slip): (ContactMode, Slip<T>),
        x: &[T],
    ) -> Solution<T> {
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
        solution.f_root = vec3::sub(&vec3::apply(&self.S, &solution.a_root), &self.b);
        if !held.is_empty() {
            let passed_on = vec3::apply_transposed(&self.G, &solution.lam);
            solution.f_root = vec3::sub(&solution.f_root, &passed_on);
        }
        let follows = vec3::apply(&self.G, &solution.a_root);
        let given_way = vec3::apply(&self.W, &solution.lam);
        solution.a_free = vec3::add(&vec3::add(&follows, &given_way), &self.alpha0);
        solution
    }

    /// Force on the root along `k` for one along the held component `m`: f_z brings its friction along.
    #[inline(always)]
    fn along(&self, m: usize, k: usize, slip: Slip<T>) -> T {
        if m == Z {
            self.G[(m, k)] - self.G[(Y, k)] * slip.free
        } else {
            self.G[(m, k)]
        }
    }

    /// Rows and columns of the free root coordinates, then of the free foot's multipliers.
    #[inline(always)]
    fn equations<const N: usize>(&self, mode: ContactMode, slip: Slip<T>) -> Equations<T, N> {
        let (live, n_live) = live_components(mode.support);
        let (held, n_held) = held_components(mode.free);
        let (mut A, mut b) = ([[T::zero(); N]; N], [T::zero(); N]);
        for (i, &r) in live[..n_live].iter().enumerate() {
            // Sliding support: f_y + mu s f_z = 0 instead of f_y = 0.
            let tie = if r == Y { slip.support } else { T::zero() };
            for (j, &k) in live[..n_live].iter().enumerate() {
                A[i][j] = self.S[(r, k)] + tie * self.S[(Z, k)];
            }
            for (j, &m) in held[..n_held].iter().enumerate() {
                A[i][n_live + j] = -(self.along(m, r, slip) + tie * self.along(m, Z, slip));
            }
            b[i] = self.b[r] + tie * self.b[Z];
        }
        for (i, &m) in held[..n_held].iter().enumerate() {
            for (j, &k) in live[..n_live].iter().enumerate() {
                A[n_live + i][j] = self.G[(m, k)];
            }
            for (j, &l) in held[..n_held].iter().enumerate() {
                let friction = if l == Z {
                    slip.free * self.W[(m, Y)]
                } else {
                    T::zero()
                };
                A[n_live + i][n_live + j] = self.W[(m, l)] - friction;
            }
            b[n_live + i] = -self.alpha0[m];
        }
        (A, b)
    }
}

impl ContactProblem {
    /// Solve for the given mode. Where constraints (almost) depend on each other, as under two straight
    /// legs, no force is larger than what they ask for consistently; what no force can do is left undone.
    ///
    /// # Errors
    /// `Singular` when the root's motion is not determined.
    pub fn solve(&self, mode: ContactMode, slip: Slip) -> Result<Solution, Termination> {
        let (solution, regular) = self.regular(mode, slip);
        if regular {
            return Ok(solution);
        }
        self.solve_dependent(mode, slip)
    }

    /// The same where the mode alone does not determine motion and forces: not `regular`.
    ///
    /// # Errors
    /// As for `solve`.
    #[inline(never)]
    pub fn solve_dependent(&self, mode: ContactMode, slip: Slip) -> Result<Solution, Termination> {
        let (live, n_live) = live_components(mode.support);
        let (held, n_held) = held_components(mode.free);
        let n = n_live + n_held;
        let scale = (n_live, self.felt(n_held));
        let equations = self.equations(mode, slip);
        let (_, outcome) = eliminate(equations, n, scale, DEPENDENT);
        match outcome.result() {
            Err(Termination::Singular) if n_held > 0 => {}
            result => result?,
        }
        let parts = (&live[..n_live], &held[..n_held]);
        let x = proximal(equations, n, scale, self.half(&held[..n_held]))?;
        Ok(self.solution(parts, (mode, slip), &x))
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
pub fn unknowns(mode: ContactMode) -> (usize, usize) {
    (
        live_components(mode.support).1,
        held_components(mode.free).1,
    )
}

/// Root coordinates that the mode leaves free, and their number.
pub fn live_components(support: Foot) -> ([usize; 3], usize) {
    match (support.touch, support.slides()) {
        (SoleContact::Air, _) => ([Y, Z, PHI], 3),
        (SoleContact::Flat, false) => ([0; 3], 0),
        (SoleContact::Flat, true) => ([Y, 0, 0], 1),
        (_, false) => ([PHI, 0, 0], 1),
        (_, true) => ([Y, PHI, 0], 2),
    }
}

/// Components of the free foot's motion that the mode holds, and their number. Straight legs leave Z to
/// nothing but rounding: it comes last, so that its pivot says so.
pub fn held_components(free: Foot) -> ([usize; 3], usize) {
    match (free.touch, free.slides()) {
        (SoleContact::Air, _) => ([0; 3], 0),
        (SoleContact::Flat, false) => ([PHI, Y, Z], 3),
        (SoleContact::Flat, true) => ([PHI, Z, 0], 2),
        (_, false) => ([Y, Z, 0], 2),
        (_, true) => ([Z, 0, 0], 1),
    }
}

/// Forces where constraints (almost) depend on each other: those nearest to `start`, by proximal iterations
/// (Rockafellar 1976). The equations and `scale` are as for `eliminate`.
fn proximal(
    (A, b): Equations<f64, MOST>,
    n: usize,
    scale: (usize, f64),
    start: [f64; 3],
) -> Result<[f64; MOST], Termination> {
    let n = n.min(MOST);
    let from = scale.0;
    let weight = PROXIMAL * (from..n).fold(scale.1, |top, i| top.max(A[i][i].abs()));
    let (mut x, mut left) = ([0.0; MOST], f64::INFINITY);
    for (x, start) in x[from.min(n)..n].iter_mut().zip(start) {
        *x = start;
    }
    loop {
        let (mut B, mut c) = (A, b);
        for i in from..n {
            B[i][i] += weight;
            c[i] += weight * x[i];
        }
        let (next, outcome) = eliminate((B, c), n, scale, 0.0);
        outcome.result()?;
        let residual = (0..n).fold(0.0_f64, |top, i| {
            let sum: f64 = (0..n).map(|j| A[i][j] * next[j]).sum();
            top.max((sum - b[i]).abs())
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

/// How an elimination went: whether a pivot was too small, or no number before that.
#[derive(Debug, Clone, Copy)]
struct Outcome<M> {
    singular: M,
    no_number: M,
}

impl<M: Mask> Outcome<M> {
    #[inline(always)]
    fn solved(self) -> M {
        !(self.singular | self.no_number)
    }
}

impl Outcome<bool> {
    fn result(self) -> Result<(), Termination> {
        match (self.no_number, self.singular) {
            (true, _) => Err(Termination::NotFinite),
            (_, true) => Err(Termination::Singular),
            _ => Ok(()),
        }
    }
}

/// Equations A x = b: room for `N` unknowns.
type Equations<T, const N: usize> = ([[T; N]; N], [T; N]);

/// Gauss with row pivoting. Singular where a pivot is less than `least` times its scale: the largest of its
/// column or, for multipliers, which start at `from`, `felt` if that is larger.
#[inline(always)]
fn eliminate<T: Scalar, const N: usize>(
    (mut A, mut b): Equations<T, N>,
    n: usize,
    (from, felt): (usize, T),
    least: T,
) -> ([T; N], Outcome<T::Mask>) {
    let n = n.min(N);
    let mut x = [T::zero(); N];
    let mut scale = [T::zero(); N];
    for k in from..n {
        scale[k] = felt;
    }
    for row in &A[..n] {
        for k in 0..n {
            scale[k] = row[k].abs().simd_max(scale[k]);
        }
    }
    let no = T::Mask::of(false);
    let mut outcome = Outcome {
        singular: no,
        no_number: no,
    };
    for k in 0..n {
        pivot(&mut A, &mut b, k, n);
        let d = A[k][k];
        let fine = outcome.solved();
        outcome.no_number = outcome.no_number | fine & !d.le(d);
        outcome.singular = outcome.singular | fine & d.abs().le(least * scale[k]);
        for i in k + 1..n {
            let factor = A[i][k] / d;
            for j in k + 1..n {
                let share = factor * A[k][j];
                A[i][j] -= share;
            }
            let share = factor * b[k];
            b[i] -= share;
        }
    }
    for k in (0..n).rev() {
        let mut value = b[k];
        for j in k + 1..n {
            value -= A[k][j] * x[j];
        }
        x[k] = value / A[k][k];
    }
    (x, outcome)
}

/// Exchange row `k` for the one of those that follow with the largest entry in column `k`; of several,
/// the last.
#[inline(always)]
fn pivot<T: Scalar, const N: usize>(A: &mut [[T; N]; N], b: &mut [T; N], k: usize, n: usize) {
    if T::LANES == 1 {
        let mut pivot = k;
        for i in k + 1..n {
            if A[i][k].abs().ge(A[pivot][k].abs()).any() {
                pivot = i;
            }
        }
        if pivot != k {
            A.swap(k, pivot);
            b.swap(k, pivot);
        }
        return;
    }
    let mut largest = A[k][k].abs();
    let mut simd_max = [T::Mask::of(false); N];
    for i in k + 1..n {
        let size = A[i][k].abs();
        simd_max[i] = size.ge(largest);
        largest = T::select(simd_max[i], size, largest);
    }
    let mut taken = T::Mask::of(false);
    for i in (k + 1..n).rev() {
        let here = simd_max[i] & !taken;
        taken = taken | here;
        for j in k..n {
            let (upper, lower) = (A[k][j], A[i][j]);
            A[k][j] = T::select(here, lower, upper);
            A[i][j] = T::select(here, upper, lower);
        }
        let (upper, lower) = (b[k], b[i]);
        b[k] = T::select(here, lower, upper);
        b[i] = T::select(here, upper, lower);
    }
}
