//! One attempted step of any method.

/// Stages of the methods with the most of them.
pub(super) const STAGES: usize = 7;
/// Where slopes lie: at the start of the step and at its end; stages are in between.
pub(super) const FIRST: usize = 0;
pub(super) const LAST: usize = STAGES - 1;

/// One attempted step and its dense output. Only the first components live; the others stay zero.
#[derive(Debug, Clone)]
pub struct Step<const N: usize> {
    pub t: f64,
    pub h: f64,
    /// Start and end of the step.
    pub y0: [f64; N],
    pub y1: [f64; N],
    pub(super) k: [[f64; N]; STAGES],
    pub(super) dense: [[f64; N]; 3],
    /// Number of components that live.
    live: usize,
    /// Their scales in the error, and how many of them are finite.
    scale: [f64; N],
    controlled: f64,
    /// Which sum of squares each belongs to.
    part: [u8; N],
}

impl<const N: usize> Step<N> {
    /// As many components live as have a scale, in their own units; a scale of infinity leaves a
    /// component out of the error. Components of the parts 1 and 2, if there are `parts`, may change
    /// places with each other without changing the error by a bit; the others are of part 0.
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

    /// Number of components that live, as the compiler can believe it.
    #[inline]
    pub(super) fn live(&self) -> usize {
        self.live.min(N)
    }

    /// Set where the step starts and how long it is; `dy0` is the right-hand side there.
    #[inline]
    pub(super) fn start(&mut self, (t, y0, dy0): (f64, &[f64; N], &[f64; N]), h: f64) {
        (self.t, self.h) = (t, h);
        let n = self.live();
        self.y0[..n].copy_from_slice(&y0[..n]);
        self.k[FIRST][..n].copy_from_slice(&dy0[..n]);
    }

    /// y1 := y0 + h sum of `weights` times the slopes, the first of them at the start.
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
            // An infinite scale makes this zero.
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

    /// Prepare `at` with the cubic that has the values and slopes of both ends.
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
