//! One attempted step of any method.

/// Largest number of stages of the methods.
pub(super) const STAGES: usize = 7;
/// Indices of the slopes at the start and at the end of the step; stages are in between.
pub(super) const FIRST: usize = 0;
pub(super) const LAST: usize = STAGES - 1;

/// One attempted step and its dense output. Only the first `live` components are used; the others are zero.
#[derive(Debug, Clone)]
pub struct Step<const N: usize> {
    pub t: f64,
    pub h: f64,
    /// Start and end of the step.
    pub y0: [f64; N],
    pub y1: [f64; N],
    pub(super) k: [[f64; N]; STAGES],
    pub(super) dense: [[f64; N]; 3],
    /// Number of components in use.
    live: usize,
    /// Scales of the components in the error norm, and the number of finite scales.
    scale: [f64; N],
    controlled: f64,
    /// Index of the sum of squares to which each component contributes.
    part: [u8; N],
}

impl<const N: usize> Step<N> {
    /// `scales` has one element per component in use, in its unit; an infinite scale excludes a component
    /// from the error. `parts` is empty or assigns each component to a part: 0, 1 or 2. The error is
    /// bit for bit the same if the components of part 1 and part 2 are swapped.
    pub fn new(scales: &[f64], parts: &[u8]) -> Self {
        let zero = [0.0; N];
        let mut scale = [f64::INFINITY; N];
        scale[..scales.len()].copy_from_slice(scales);
        let mut part = [0; N];
        part[..parts.len()].copy_from_slice(parts);
        Self {
            t: 0.0,
            h: 0.0,
            y0: zero,
            y1: zero,
            k: [zero; STAGES],
            dense: [zero; 3],
            live: scales.len(),
            scale,
            part,
            controlled: scales.iter().filter(|s| s.is_finite()).count() as f64,
        }
    }

    /// Number of components in use, with the bound `N` that removes bounds checks.
    #[inline]
    pub(super) fn live(&self) -> usize {
        self.live.min(N)
    }

    /// Set the start and the length of the step; `dy0` is the right-hand side at the start.
    #[inline]
    pub(super) fn start(&mut self, (t, y0, dy0): (f64, &[f64; N], &[f64; N]), h: f64) {
        (self.t, self.h) = (t, h);
        let n = self.live();
        self.y0[..n].copy_from_slice(&y0[..n]);
        self.k[FIRST][..n].copy_from_slice(&dy0[..n]);
    }

    /// y1 := y0 + h sum(weights[j] k[j]); k[0] is the slope at the start.
    #[inline]
    pub(super) fn combine<const S: usize>(&mut self, weights: [f64; S]) {
        let h = weights.map(|a| self.h * a);
        let k = &self.k;
        for i in 0..self.live() {
            let mut y = self.y0[i];
            for j in 0..S {
                y += h[j] * k[j][i];
            }
            self.y1[i] = y;
        }
    }

    /// Root mean square of the local error over `tolerance (scale_i + |y_i|)`; `slope` gives the
    /// error of a component per unit of h.
    #[inline]
    pub(super) fn norm(&self, tolerance: f64, slope: impl Fn(usize) -> f64) -> f64 {
        let mut squares = [0.0; N];
        for i in 0..self.live() {
            let size = self.scale[i] + self.y0[i].abs().max(self.y1[i].abs());
            let share = self.h * slope(i) / (tolerance * size);
            // Zero for an infinite scale.
            squares[i] = share * share;
        }
        let mut sums = [0.0; 4];
        for i in 0..self.live() {
            sums[usize::from(self.part[i] & 3)] += squares[i];
        }
        let sum = sums[0] + (sums[1] + sums[2]);
        (sum / self.controlled).sqrt()
    }

    /// Right-hand side at the end of the step.
    pub fn dy1(&self) -> &[f64; N] {
        &self.k[LAST]
    }

    /// Prepare the dense output with the cubic Hermite polynomial of both ends.
    pub(super) fn cubic(&mut self) {
        for i in 0..self.live() {
            let difference = self.y1[i] - self.y0[i];
            let bend = self.h * self.k[FIRST][i] - difference;
            self.dense[0][i] = bend;
            self.dense[1][i] = difference - self.h * self.k[LAST][i] - bend;
            self.dense[2][i] = 0.0;
        }
    }

    /// The solution at the fraction `theta` of the step.
    pub fn at(&self, theta: f64) -> [f64; N] {
        let mut y = [0.0; N];
        for (i, y) in y[..self.live()].iter_mut().enumerate() {
            *y = self.component(i, theta);
        }
        y
    }

    /// One component of `at`.
    #[inline]
    pub fn component(&self, i: usize, theta: f64) -> f64 {
        let back = 1.0 - theta;
        let inner = self.dense[1][i] + back * self.dense[2][i];
        let outer = self.dense[0][i] + theta * inner;
        self.y0[i] + theta * (self.y1[i] - self.y0[i] + back * outer)
    }
}
