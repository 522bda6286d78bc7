//! Explicit Runge-Kutta pair 5(4) with dense output.
//!
//! Coefficients: Dormand and Prince (1980), table 2; error estimate and continuous extension of
//! order 4 as in Hairer, Norsett and Wanner (1993), section II.6, eqs. 6.12 to 6.14.

use crate::{
    error::Termination,
    integrate::{Start, System, TimeStep},
    numeric::scalar::Scalar,
};

/// Slopes: at the start, of the stages, and at the end.
pub const STAGES: usize = 7;
/// Index of the slope at the end of the step.
const LAST: usize = STAGES - 1;
pub const C: [f64; STAGES] = [0.0, 1.0 / 5.0, 3.0 / 10.0, 4.0 / 5.0, 8.0 / 9.0, 1.0, 1.0];
/// The last row is also the solution of order 5 (first same as last).
pub const A: [[f64; 6]; STAGES] = [
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
pub const E: [f64; STAGES] = [
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

impl<const N: usize, T: Scalar> TimeStep<N, T> {
    /// Advance by `h` from `start`. The last evaluation is at the end of the step.
    #[inline(always)]
    pub(super) fn dopri5(
        &mut self,
        system: &mut impl System<N, T>,
        start: Start<'_, N, T>,
        h: T,
    ) -> Result<(), Termination> {
        self.start(start, h, LAST);
        self.stage::<1>(system)?;
        self.stage::<2>(system)?;
        self.stage::<3>(system)?;
        self.stage::<4>(system)?;
        self.stage::<5>(system)?;
        self.stage::<6>(system)
    }

    /// Evaluate stage `S`; the last stage is evaluated at the end of the step.
    #[inline(always)]
    fn stage<const S: usize>(&mut self, system: &mut impl System<N, T>) -> Result<(), Termination> {
        let a: [f64; S] = std::array::from_fn(|j| A[S][j]);
        self.combine(a);
        system.rhs(self.t + T::of(C[S]) * self.h, &self.y1, &mut self.k[S])
    }

    /// Prepare the dense output, `at`.
    #[inline(always)]
    pub(super) fn dopri5_dense(&mut self) {
        self.cubic(0..self.live());
        for i in 0..self.live() {
            let mut sum = T::of(-0.0);
            for s in 0..STAGES {
                sum += T::of(D[s]) * self.k[s][i];
            }
            self.dense[2][i] = self.h * sum;
        }
    }
}

impl<const N: usize> TimeStep<N> {
    /// Root mean square of the local error, see `TimeStep::mean_square`.
    pub(super) fn dopri5_error(&self, tolerance: f64) -> f64 {
        self.mean_square(tolerance, |i| {
            E[0] * self.k[0][i]
                + E[2] * self.k[2][i]
                + E[3] * self.k[3][i]
                + E[4] * self.k[4][i]
                + E[5] * self.k[5][i]
                + E[6] * self.k[6][i]
        })
        .sqrt()
    }
}
