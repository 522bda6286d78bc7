//! Explicit Runge-Kutta pair 5(4) with dense output.
//!
//! Coefficients: Dormand and Prince (1980), table 2; error estimate and continuous extension of
//! order 4 as in Hairer, Norsett and Wanner (1993), section II.6, eqs. 6.12 to 6.14.

use super::Flow;
use crate::error::EndCause;

const STAGES: usize = 7;
const C: [f64; STAGES] = [0.0, 1.0 / 5.0, 3.0 / 10.0, 4.0 / 5.0, 8.0 / 9.0, 1.0, 1.0];
/// The last row is also the solution of order 5 (first same as last).
const A: [[f64; 6]; STAGES] = [
    [0.0; 6],
    [1.0 / 5.0, 0.0, 0.0, 0.0, 0.0, 0.0],
    [3.0 / 40.0, 9.0 / 40.0, 0.0, 0.0, 0.0, 0.0],
    [44.0 / 45.0, -56.0 / 15.0, 32.0 / 9.0, 0.0, 0.0, 0.0],
    [
        19372.0 / 6561.0,
        -25360.0 / 2187.0,
        64448.0 / 6561.0,
        -212.0 / 729.0,
        0.0,
        0.0,
    ],
    [
        9017.0 / 3168.0,
        -355.0 / 33.0,
        46732.0 / 5247.0,
        49.0 / 176.0,
        -5103.0 / 18656.0,
        0.0,
    ],
    [
        35.0 / 384.0,
        0.0,
        500.0 / 1113.0,
        125.0 / 192.0,
        -2187.0 / 6784.0,
        11.0 / 84.0,
    ],
];
/// Order 5 minus order 4.
const E: [f64; STAGES] = [
    71.0 / 57600.0,
    0.0,
    -71.0 / 16695.0,
    71.0 / 1920.0,
    -17253.0 / 339200.0,
    22.0 / 525.0,
    -1.0 / 40.0,
];
/// Continuous extension.
const D: [f64; STAGES] = [
    -12715105075.0 / 11282082432.0,
    0.0,
    87487479700.0 / 32700410799.0,
    -10690763975.0 / 1880347072.0,
    701980252875.0 / 199316789632.0,
    -1453857185.0 / 822651844.0,
    69997945.0 / 29380423.0,
];

/// One attempted step and its dense output. Only the first components live; the others stay zero.
#[derive(Debug, Clone)]
pub struct Step<const N: usize> {
    pub t: f64,
    pub h: f64,
    /// Start and end of the step.
    pub y0: [f64; N],
    pub y1: [f64; N],
    k: [[f64; N]; STAGES],
    dense: [[f64; N]; 3],
    /// Number of components that live.
    live: usize,
    /// Their scales in the error, and how many of them are finite.
    scale: [f64; N],
    controlled: f64,
}

impl<const N: usize> Step<N> {
    /// As many components live as have a scale, in their own units; a scale of infinity leaves a
    /// component out of the error.
    pub fn new(scales: &[f64]) -> Self {
        let zero = [0.0; N];
        let mut scale = [f64::INFINITY; N];
        scale[..scales.len()].copy_from_slice(scales);
        Self {
            t: 0.0,
            h: 0.0,
            y0: zero,
            y1: zero,
            k: [zero; STAGES],
            dense: [zero; 3],
            live: scales.len(),
            scale,
            controlled: scales.iter().filter(|s| s.is_finite()).count() as f64,
        }
    }

    /// Advance from `y0` by `h`; `dy0` is the right-hand side at (t, y0). The last evaluation is at
    /// the end of the step.
    pub fn attempt(
        &mut self,
        flow: &mut impl Flow<N>,
        (t, y0, dy0): (f64, &[f64; N], &[f64; N]),
        h: f64,
    ) -> Result<(), EndCause> {
        (self.t, self.h) = (t, h);
        let n = self.live.min(N);
        self.y0[..n].copy_from_slice(&y0[..n]);
        self.k[0][..n].copy_from_slice(&dy0[..n]);
        self.stage::<1>(flow)?;
        self.stage::<2>(flow)?;
        self.stage::<3>(flow)?;
        self.stage::<4>(flow)?;
        self.stage::<5>(flow)?;
        self.stage::<6>(flow)
    }

    /// Evaluate stage `S`; the last one's argument is the end of the step.
    fn stage<const S: usize>(&mut self, flow: &mut impl Flow<N>) -> Result<(), EndCause> {
        let ha = A[S].map(|a| self.h * a);
        let k = &self.k;
        for i in 0..self.live.min(N) {
            let mut y = self.y0[i];
            for j in 0..S {
                y += ha[j] * k[j][i];
            }
            self.y1[i] = y;
        }
        flow.rhs(self.t + C[S] * self.h, &self.y1, &mut self.k[S])
    }

    /// Right-hand side at the end of the step.
    pub fn dy1(&self) -> &[f64; N] {
        &self.k[STAGES - 1]
    }

    /// Root mean square of the local error over `tolerance (scale_i + |y_i|)`.
    pub fn error(&self, tolerance: f64) -> f64 {
        let mut sum = 0.0;
        for i in 0..self.live.min(N) {
            let e = E[0] * self.k[0][i]
                + E[2] * self.k[2][i]
                + E[3] * self.k[3][i]
                + E[4] * self.k[4][i]
                + E[5] * self.k[5][i]
                + E[6] * self.k[6][i];
            let size = self.scale[i] + self.y0[i].abs().max(self.y1[i].abs());
            let share = self.h * e / (tolerance * size);
            // An infinite scale makes this zero.
            sum += share * share;
        }
        (sum / self.controlled).sqrt()
    }

    /// Prepare `at`.
    pub fn make_dense(&mut self) {
        for i in 0..self.live.min(N) {
            let difference = self.y1[i] - self.y0[i];
            let bend = self.h * self.k[0][i] - difference;
            let sum: f64 = (0..STAGES).map(|s| D[s] * self.k[s][i]).sum();
            self.dense[0][i] = bend;
            self.dense[1][i] = difference - self.h * self.k[6][i] - bend;
            self.dense[2][i] = self.h * sum;
        }
    }

    /// The solution at the fraction `theta` of the step.
    pub fn at(&self, theta: f64) -> [f64; N] {
        let mut y = [0.0; N];
        for (i, y) in y[..self.live.min(N)].iter_mut().enumerate() {
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

/// Factor for the next step size after an error (1 = tolerance); order 5, safety 0.9, 0.2 to 5.
pub fn step_factor(error: f64) -> f64 {
    (0.9 * error.max(1e-10).powf(-0.2)).clamp(0.2, 5.0)
}
