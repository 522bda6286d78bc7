//! Linearly implicit methods that keep their order whatever matrix A stands for the Jacobian
//! (W-methods: Steihaug and Wolfbrandt 1979; Hairer and Wanner 1996, section IV.7).
//!
//! Stage i solves (I - gamma h A) w_i = f(y0 + h sum a_ij w_j) + sum c_ij w_j, and
//! y1 = y0 + h sum m_i w_i: the printed coefficients alpha, gamma_ij, b after the substitution
//! w = Gamma k / gamma, which avoids products with A (there eq. 7.25, with w for u / (gamma h)).

#![allow(clippy::excessive_precision)] // Coefficients as printed.

use crate::{
    error::Termination,
    integrate::{Start, System, TimeStep, step::FIRST},
};

const STAGES: usize = 4;
/// Index of the slope at the end of the step.
const LAST: usize = STAGES + 1;
type Matrix = [[f64; STAGES]; STAGES];

/// ROS34PW2 as printed: order 3, stiffly accurate, with an error estimate of order 2 (Rang and Angermann
/// 2005, "New Rosenbrock W-methods of order 3 for partial differential algebraic equations of index 1").
pub const ALPHA: Matrix = [
    [0.0, 0.0, 0.0, 0.0],
    [8.7173304301691801e-01, 0.0, 0.0, 0.0],
    [8.4457060015369423e-01, -1.1299064236484185e-01, 0.0, 0.0],
    [0.0, 0.0, 1.0, 0.0],
];
/// All diagonal elements are gamma.
pub const GAMMA: Matrix = [
    [4.3586652150845900e-01, 0.0, 0.0, 0.0],
    [-8.7173304301691801e-01, 4.3586652150845900e-01, 0.0, 0.0],
    [
        -9.0338057013044082e-01,
        5.4180672388095326e-02,
        4.3586652150845900e-01,
        0.0,
    ],
    [
        2.4212380706095346e-01,
        -1.2232505839045147e+00,
        5.4526025533510214e-01,
        4.3586652150845900e-01,
    ],
];
pub const B: [f64; STAGES] = [
    2.4212380706095346e-01,
    -1.2232505839045147e+00,
    1.5452602553351020e+00,
    4.3586652150845900e-01,
];
/// Weights of the solution of order 2.
pub const B_LOW: [f64; STAGES] = [
    3.7810903145819369e-01,
    -9.6042292212423178e-02,
    5.0000000000000000e-01,
    2.1793326075422950e-01,
];

/// Coefficients after the substitution.
struct Table {
    /// Time of each stage, as a fraction of the step.
    nodes: [f64; STAGES],
    a: Matrix,
    c: Matrix,
    m: [f64; STAGES],
    /// Difference of the solutions of order 3 and order 2.
    e: [f64; STAGES],
}

const TABLE: Table = substituted();

const fn substituted() -> Table {
    let gamma = GAMMA[0][0];
    let inverse = inverse_of_gamma();
    let zero = [[0.0; STAGES]; STAGES];
    let mut table = Table {
        nodes: zero[0],
        a: zero,
        c: zero,
        m: zero[0],
        e: zero[0],
    };
    let mut i = 0;
    while i < STAGES {
        let mut j = 0;
        while j < STAGES {
            table.nodes[i] += ALPHA[i][j];
            let mut k = 0;
            while k < STAGES {
                table.a[i][j] += gamma * ALPHA[i][k] * inverse[k][j];
                k += 1;
            }
            table.c[i][j] = if i > j { -gamma * inverse[i][j] } else { 0.0 };
            table.m[j] += gamma * B[i] * inverse[i][j];
            table.e[j] += gamma * (B[i] - B_LOW[i]) * inverse[i][j];
            j += 1;
        }
        i += 1;
    }
    table
}

const fn inverse_of_gamma() -> Matrix {
    let mut x = [[0.0; STAGES]; STAGES];
    let mut j = 0;
    while j < STAGES {
        let mut i = j;
        while i < STAGES {
            let mut sum = if i == j { 1.0 } else { 0.0 };
            let mut k = j;
            while k < i {
                sum -= GAMMA[i][k] * x[k][j];
                k += 1;
            }
            x[i][j] = sum / GAMMA[i][i];
            i += 1;
        }
        j += 1;
    }
    x
}

impl<const N: usize> TimeStep<N> {
    /// As `dopri5`; the system has just been evaluated at the start.
    pub(super) fn rosenbrock(
        &mut self,
        system: &mut impl System<N>,
        start: Start<'_, N>,
        h: f64,
    ) -> Result<(), Termination> {
        self.start(start, h, LAST);
        let n = self.live();
        system.factor(&self.y0, GAMMA[0][0] * h)?;
        // `k` holds the slope at the start, then w of each stage.
        for s in 0..STAGES {
            let mut x = self.k[FIRST];
            if s > 0 {
                for i in 0..n {
                    let sum: f64 = (0..s).map(|j| TABLE.a[s][j] * self.k[1 + j][i]).sum();
                    self.y1[i] = self.y0[i] + h * sum;
                }
                system.rhs(self.t + TABLE.nodes[s] * h, &self.y1, &mut x)?;
                for i in 0..n {
                    x[i] += (0..s)
                        .map(|j| TABLE.c[s][j] * self.k[1 + j][i])
                        .sum::<f64>();
                }
            }
            system.solve(&mut x)?;
            self.k[1 + s] = x;
        }
        for i in 0..n {
            let sum: f64 = (0..STAGES).map(|j| TABLE.m[j] * self.k[1 + j][i]).sum();
            self.y1[i] = self.y0[i] + h * sum;
        }
        system.rhs(self.t + h, &self.y1, &mut self.k[LAST])
    }

    /// Root mean square of the local error, see `TimeStep::mean_square`.
    pub(super) fn rosenbrock_error(&self, tolerance: f64) -> f64 {
        self.mean_square(tolerance, |i| {
            (0..STAGES).map(|j| TABLE.e[j] * self.k[1 + j][i]).sum()
        })
        .sqrt()
    }
}
