//! Small dense linear systems: Gaussian elimination, and proximal iterations where equations depend on each
//! other.

use crate::{
    error::Termination,
    numeric::scalar::{Mask, Scalar},
};

/// Solution of (almost) dependent equations: the multipliers nearest to `start`, by proximal iterations
/// (Rockafellar 1976), and whether they satisfy the equations. The arguments are those of `eliminate`.
///
/// # Errors
/// `Singular` or `NotFinite` where an elimination fails.
pub fn proximal<const N: usize>(
    (A, b): Equations<f64, N>,
    n: usize,
    scale: (usize, f64),
    start: [f64; 3],
) -> Result<([f64; N], bool), Termination> {
    let n = n.min(N);
    let from = scale.0;
    let weight = PROXIMAL * (from..n).fold(scale.1, |top, i| top.max(A[i][i].abs()));
    let (mut x, mut residual) = ([0.0; N], f64::INFINITY);
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
        let next_residual = (0..n).fold(0.0_f64, |largest, i| {
            let sum: f64 = (0..n).map(|j| A[i][j] * next[j]).sum();
            largest.max((sum - b[i]).abs())
        });
        // The consistent part converges in two or three iterations; a contradiction stays.
        if next_residual < 0.1 * residual {
            (x, residual) = (next, next_residual);
        } else {
            let largest = b[..n].iter().fold(0.0_f64, |top, x| top.max(x.abs()));
            return Ok((x, residual <= SATISFIED * largest + ROUNDING));
        }
    }
}

/// Largest residual of equations that are satisfied: relative to the largest right-hand side, and rounding
/// errors of motions at rest [m/s2, m/s]. Measured: 4e-12, and 4e-12 at rest.
const SATISFIED: f64 = 1e-9;
const ROUNDING: f64 = 1e-10;

/// Weight of a proximal step relative to the largest mobility.
const PROXIMAL: f64 = 1e-6;

/// Outcome of an elimination: a pivot that was too small, or not finite before that.
#[derive(Debug, Clone, Copy)]
pub struct Outcome<M> {
    singular: M,
    not_finite: M,
}

impl<M: Mask> Outcome<M> {
    #[inline(always)]
    pub fn solved(self) -> M {
        !(self.singular | self.not_finite)
    }
}

impl Outcome<bool> {
    /// # Errors
    /// `NotFinite` or `Singular`, whichever came first.
    pub fn result(self) -> Result<(), Termination> {
        match (self.not_finite, self.singular) {
            (true, _) => Err(Termination::NotFinite),
            (_, true) => Err(Termination::Singular),
            _ => Ok(()),
        }
    }
}

/// Equations A x = b with at most `N` unknowns.
pub type Equations<T, const N: usize> = ([[T; N]; N], [T; N]);

/// Gaussian elimination with row pivoting of the first `n` equations. Singular where a pivot is less than
/// `least` times its scale: the largest entry of its column or, for multipliers, which start at `from`,
/// `mobility` if that is larger.
#[inline(always)]
pub fn eliminate<T: Scalar, const N: usize>(
    (mut A, mut b): Equations<T, N>,
    n: usize,
    (from, mobility): (usize, T),
    least: T,
) -> ([T; N], Outcome<T::Mask>) {
    let n = n.min(N);
    let mut x = [T::zero(); N];
    let mut scale = [T::zero(); N];
    for k in from..n {
        scale[k] = mobility;
    }
    for row in &A[..n] {
        for k in 0..n {
            scale[k] = row[k].abs().simd_max(scale[k]);
        }
    }
    let mut outcome = Outcome {
        singular: T::Mask::of(false),
        not_finite: T::Mask::of(false),
    };
    for k in 0..n {
        pivot(&mut A, &mut b, k, n);
        let d = A[k][k];
        let solved = outcome.solved();
        outcome.not_finite = outcome.not_finite | solved & !d.le(d);
        outcome.singular = outcome.singular | solved & d.abs().le(least * scale[k]);
        for i in k + 1..n {
            let factor = A[i][k] / d;
            for j in k + 1..n {
                let product = factor * A[k][j];
                A[i][j] -= product;
            }
            let product = factor * b[k];
            b[i] -= product;
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

/// Exchange row `k` with the row from `k` on that has the largest entry in column `k`; the last of several.
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
    let mut is_larger = [T::Mask::of(false); N];
    for i in k + 1..n {
        let size = A[i][k].abs();
        is_larger[i] = size.ge(largest);
        largest = T::select(is_larger[i], size, largest);
    }
    let mut taken = T::Mask::of(false);
    for i in (k + 1..n).rev() {
        let here = is_larger[i] & !taken;
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
