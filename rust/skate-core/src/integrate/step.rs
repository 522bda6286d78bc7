//! One attempted step of any method.

use crate::numeric::{dual::Dual, scalar::Scalar};
use std::ops::RangeInclusive;

/// Largest number of slopes of the methods.
const STAGES: usize = 16;
/// Index of the slope at the start of the step.
pub(super) const FIRST: usize = 0;
/// Number of coefficients of the dense output besides both ends.
const DENSE: usize = 6;

/// Largest product h rho of an explicit step with the fastest rate. Up to it a step of `dop853` damps the fastest motion
/// to 7 % and less; beyond 6.4 that grows until the error control notices, and disturbs the contact forces meanwhile.
const LIMIT: f64 = 5.0;

/// The fastest motion in a step, estimated from two states at its end (Hairer and Wanner 1996, section IV.2, on the
/// automatic detection of stiffness).
#[derive(Debug, Clone, Copy, Default)]
pub struct Stiffness<T> {
    /// (h rho)^2, with the rate rho of that motion.
    pub h_rho_squared: T,
    /// Mean square of its relative size.
    pub size_squared: T,
}

impl Stiffness<f64> {
    /// Factor on the length of an accepted step that brings h rho to its limit.
    pub fn factor(self) -> f64 {
        (LIMIT / self.h_rho_squared.sqrt()).max(0.2)
    }
}

/// Size of a component, to which its local error is relative: `absolute + relative |y|`. An infinite size excludes a
/// component from the error.
#[derive(Debug, Clone, Copy)]
pub struct Size {
    /// In the component's unit.
    pub absolute: f64,
    pub relative: f64,
}

impl Size {
    /// 1 + |y|.
    pub const UNIT: Self = Self {
        absolute: 1.0,
        relative: 1.0,
    };
}

/// Where a step starts; `slope` is the right-hand side there.
#[derive(Debug, Clone, Copy)]
pub struct Start<'a, const N: usize, T = f64> {
    pub t: T,
    pub y: &'a [T; N],
    pub slope: &'a [T; N],
}

/// One attempted step and its dense output. Only the first `live` components are used; the others are zero.
#[derive(Debug, Clone)]
pub struct TimeStep<const N: usize, T = f64> {
    pub t: T,
    pub h: T,
    /// Start and end of the step.
    pub y0: [T; N],
    pub y1: [T; N],
    /// Slopes at the start, of the stages, and at the end.
    pub(crate) k: [[T; N]; STAGES],
    /// Index of the slope at the end of the step.
    end: usize,
    pub(super) dense: [[T; N]; DENSE],
    /// The dense output is the method's own.
    pub(super) is_dense: bool,
    /// State of the last stage of `dop853`, which is at the end of the step.
    pub(super) last: [T; N],
    /// The fastest motion, if the method estimates it; else zero. Set by `error`.
    pub(crate) stiffness: Stiffness<T>,
    /// Number of components in use.
    live: usize,
    /// Sizes of the components in the error norm, and the number of finite ones.
    sizes: [Size; N],
    controlled: f64,
    /// Index of the sum of squares to which each component contributes.
    part: [u8; N],
}

impl<const N: usize, T: Scalar> TimeStep<N, T> {
    /// `sizes` has one element per component in use. `parts` is empty or assigns each component to a part: 0, 1 or 2.
    /// The error is bit for bit the same if the components of part 1 and part 2 are swapped.
    pub fn new(sizes: &[Size], parts: &[u8]) -> Self {
        let zero = [T::zero(); N];
        let excluded = Size {
            absolute: f64::INFINITY,
            relative: 0.0,
        };
        let mut all = [excluded; N];
        all[..sizes.len()].copy_from_slice(sizes);
        let mut part = [0; N];
        part[..parts.len()].copy_from_slice(parts);
        Self {
            t: T::zero(),
            h: T::zero(),
            y0: zero,
            y1: zero,
            k: [zero; STAGES],
            end: FIRST,
            dense: [zero; DENSE],
            is_dense: false,
            last: zero,
            stiffness: Stiffness::default(),
            live: sizes.len(),
            sizes: all,
            part,
            controlled: sizes.iter().filter(|s| s.absolute.is_finite()).count() as f64,
        }
    }

    /// A workspace for the components of `other`. It does not allocate.
    pub fn like<S: Scalar>(other: &TimeStep<N, S>) -> Self {
        Self {
            live: other.live,
            sizes: other.sizes,
            controlled: other.controlled,
            part: other.part,
            ..Self::new(&[], &[])
        }
    }

    /// Number of components in use, with the bound `N` that removes bounds checks.
    #[inline]
    pub(super) fn live(&self) -> usize {
        self.live.min(N)
    }

    /// Set the start and the length of the step; `end` is the index of the slope at its end.
    #[inline(always)]
    pub fn start(&mut self, Start { t, y, slope }: Start<'_, N, T>, h: T, end: usize) {
        (self.t, self.h, self.end, self.is_dense) = (t, h, end, false);
        let n = self.live();
        self.y0[..n].copy_from_slice(&y[..n]);
        self.k[FIRST][..n].copy_from_slice(&slope[..n]);
    }

    /// y1 := y0 + h sum(weights[j] k[j]); k[0] is the slope at the start.
    #[inline(always)]
    pub(super) fn combine<const S: usize>(&mut self, weights: [f64; S]) {
        let h = weights.map(|a| self.h * T::of(a));
        let k = &self.k;
        for i in 0..self.live() {
            let mut y = self.y0[i];
            for j in 0..S {
                y += h[j] * k[j][i];
            }
            self.y1[i] = y;
        }
    }

    /// Right-hand side at the end of the step.
    pub fn dy1(&self) -> &[T; N] {
        &self.k[self.end]
    }

    /// Is the dense output the method's own?
    pub fn is_dense(&self) -> bool {
        self.is_dense
    }

    /// Distance of the dense output, summed over `components`, from the chord between both ends, at most.
    pub fn bend(&self, components: RangeInclusive<usize>) -> T {
        let mut sums = [T::zero(); DENSE];
        for i in components {
            for (sum, dense) in sums.iter_mut().zip(&self.dense) {
                *sum += dense[i];
            }
        }
        let mut bend = T::zero();
        for sum in sums {
            bend += sum.abs();
        }
        bend
    }

    /// Prepare the dense output of some components with the cubic Hermite polynomial of both ends.
    #[inline(always)]
    pub fn cubic(&mut self, components: impl Iterator<Item = usize>) {
        for i in components {
            let difference = self.y1[i] - self.y0[i];
            let bend = self.h * self.k[FIRST][i] - difference;
            self.dense[0][i] = bend;
            self.dense[1][i] = difference - self.h * self.k[self.end][i] - bend;
            for dense in &mut self.dense[2..] {
                dense[i] = T::zero();
            }
        }
    }

    /// The solution at the fraction `theta` of the step.
    #[inline(always)]
    pub fn at(&self, theta: T) -> [T; N] {
        let mut y = [T::zero(); N];
        for (i, y) in y[..self.live()].iter_mut().enumerate() {
            *y = self.component(i, theta);
        }
        y
    }

    /// Mean square of the local error over `tolerance` times its size; `slope` gives the error of a component
    /// per unit of h.
    #[inline(always)]
    pub(super) fn mean_square(&self, tolerance: T, slope: impl Fn(usize) -> T) -> T {
        let mut sums = [T::zero(); 4];
        for i in 0..self.live() {
            let Size { absolute, relative } = self.sizes[i];
            let y = self.y1[i].abs().simd_max(self.y0[i].abs());
            let size = T::of(absolute) + T::of(relative) * y;
            let share = self.h * slope(i) / (tolerance * size);
            // Zero for an infinite size.
            sums[usize::from(self.part[i] & 3)] += share * share;
        }
        (sums[0] + (sums[1] + sums[2])) / T::of(self.controlled)
    }

    /// One component of `at`.
    #[inline(always)]
    pub fn component(&self, i: usize, theta: T) -> T {
        let dense = std::array::from_fn(|j| self.dense[j][i]);
        polynomial((self.y0[i], self.y1[i]), dense, theta)
    }
}

/// Dense output of a component from `y0` to `y1`.
#[inline(always)]
fn polynomial<T: Scalar>((y0, y1): (T, T), dense: [T; DENSE], theta: T) -> T {
    let back = T::one() - theta;
    let [d0, d1, d2, d3, d4, d5] = dense;
    let inner = d2 + theta * (d3 + back * (d4 + theta * d5));
    y0 + theta * (y1 - y0 + back * (d0 + theta * (d1 + back * inner)))
}

impl<const N: usize> TimeStep<N> {
    /// Defect of the dense output at `theta`, where the right-hand side is `dy`: h (dy - y') as a multiple of the
    /// tolerance, in the norm of the error (Enright 1989).
    pub fn defect(&self, theta: f64, dy: &[f64; N], tolerance: f64) -> f64 {
        let slope = self.slope(theta);
        self.mean_square(tolerance, |i| dy[i] - slope[i] / self.h)
            .sqrt()
    }

    /// Derivative of `at` by `theta`.
    pub fn slope(&self, theta: f64) -> [f64; N] {
        let theta = Dual { x: theta, d: 1.0 };
        let mut slope = [0.0; N];
        for (i, slope) in slope[..self.live()].iter_mut().enumerate() {
            let ends = (Dual::of(self.y0[i]), Dual::of(self.y1[i]));
            let dense = std::array::from_fn(|j| Dual::of(self.dense[j][i]));
            *slope = polynomial(ends, dense, theta).d;
        }
        slope
    }
}
