//! Linearly implicit methods that keep their order whatever matrix A stands for the Jacobian
//! (W-methods: Steihaug and Wolfbrandt 1979; Hairer and Wanner 1996, section IV.7).
//!
//! Stage i solves (I - gamma h A) w_i = f(y0 + h sum a_ij w_j) + sum c_ij w_j, and
//! y1 = y0 + h sum m_i w_i: the printed coefficients alpha, gamma_ij, b after the substitution
//! w = Gamma k / gamma, which spares products with A (there eq. 7.25, with w for u / (gamma h)).

use super::{
    Step, System,
    step::{FIRST, LAST},
};
use crate::error::EndCause;

/// A method of `S` stages, as printed.
#[derive(Debug, Clone, Copy)]
pub struct Printed<const S: usize> {
    pub alpha: [[f64; S]; S],
    /// The diagonal is `gamma` throughout.
    pub gamma: [[f64; S]; S],
    pub b: [f64; S],
    /// Weights of the solution of lower order.
    pub b_low: [f64; S],
}

/// The same after the substitution.
#[derive(Debug, Clone, Copy)]
pub struct Table<const S: usize> {
    gamma: f64,
    /// When a stage is evaluated, as a fraction of the step.
    when: [f64; S],
    a: [[f64; S]; S],
    c: [[f64; S]; S],
    m: [f64; S],
    /// Higher order minus lower.
    e: [f64; S],
}

impl<const S: usize> Printed<S> {
    /// Substitute.
    pub const fn table(&self) -> Table<S> {
        let gamma = self.gamma[0][0];
        let inverse = self.inverse();
        let mut table = Table {
            gamma,
            when: [0.0; S],
            a: [[0.0; S]; S],
            c: [[0.0; S]; S],
            m: [0.0; S],
            e: [0.0; S],
        };
        let mut i = 0;
        while i < S {
            let mut j = 0;
            while j < S {
                table.when[i] += self.alpha[i][j];
                let mut k = 0;
                while k < S {
                    table.a[i][j] += gamma * self.alpha[i][k] * inverse[k][j];
                    k += 1;
                }
                table.c[i][j] = if i > j { -gamma * inverse[i][j] } else { 0.0 };
                table.m[j] += gamma * self.b[i] * inverse[i][j];
                table.e[j] += gamma * (self.b[i] - self.b_low[i]) * inverse[i][j];
                j += 1;
            }
            i += 1;
        }
        table
    }

    /// Of the triangular matrix gamma.
    const fn inverse(&self) -> [[f64; S]; S] {
        let mut x = [[0.0; S]; S];
        let mut j = 0;
        while j < S {
            let mut i = j;
            while i < S {
                let mut sum = if i == j { 1.0 } else { 0.0 };
                let mut k = j;
                while k < i {
                    sum -= self.gamma[i][k] * x[k][j];
                    k += 1;
                }
                x[i][j] = sum / self.gamma[i][i];
                i += 1;
            }
            j += 1;
        }
        x
    }
}

/// 1 + 1/sqrt(2): the method is L-stable with the exact Jacobian.
const GAMMA_2: f64 = 1.0 + std::f64::consts::FRAC_1_SQRT_2;

/// ROS2, order 2 (Verwer, Spee, Blom and Hundsdorfer 1999, eq. 4); the lower order is that of the
/// linearly implicit Euler method.
pub const ROS2: Printed<2> = Printed {
    alpha: [[0.0, 0.0], [1.0, 0.0]],
    gamma: [[GAMMA_2, 0.0], [-2.0 * GAMMA_2, GAMMA_2]],
    b: [0.5, 0.5],
    b_low: [1.0, 0.0],
};

/// ROS34PW2, order 3, stiffly accurate (Rang and Angermann 2005, table 4).
pub const ROS34PW2: Printed<4> = Printed {
    alpha: [
        [0.0, 0.0, 0.0, 0.0],
        [8.7173304301691801e-01, 0.0, 0.0, 0.0],
        [8.4457060015369423e-01, -1.1299064236484185e-01, 0.0, 0.0],
        [0.0, 0.0, 1.0, 0.0],
    ],
    gamma: [
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
    ],
    b: [
        2.4212380706095346e-01,
        -1.2232505839045147e+00,
        1.5452602553351020e+00,
        4.3586652150845900e-01,
    ],
    b_low: [
        3.7810903145819369e-01,
        -9.6042292212423178e-02,
        5.0000000000000000e-01,
        2.1793326075422950e-01,
    ],
};

impl<const N: usize> Step<N> {
    /// As `dopri5`; the system has just been evaluated at the start.
    pub(super) fn rosenbrock<const S: usize>(
        &mut self,
        table: &Table<S>,
        system: &mut impl System<N>,
        start: (f64, &[f64; N], &[f64; N]),
        h: f64,
    ) -> Result<(), EndCause> {
        self.start(start, h);
        let n = self.live();
        system.factor(table.gamma * h)?;
        // What a stage solves for, w, stands after the slope at the start.
        for s in 0..S {
            let mut x = self.k[FIRST];
            if s > 0 {
                for i in 0..n {
                    let sum: f64 = (0..s).map(|j| table.a[s][j] * self.k[1 + j][i]).sum();
                    self.y1[i] = self.y0[i] + h * sum;
                }
                system.rhs(self.t + table.when[s] * h, &self.y1, &mut x)?;
                for i in 0..n {
                    x[i] += (0..s).map(|j| table.c[s][j] * self.k[1 + j][i]).sum::<f64>();
                }
            }
            system.solve(&mut x)?;
            self.k[1 + s] = x;
        }
        for i in 0..n {
            let sum: f64 = (0..S).map(|j| table.m[j] * self.k[1 + j][i]).sum();
            self.y1[i] = self.y0[i] + h * sum;
        }
        system.rhs(self.t + h, &self.y1, &mut self.k[LAST])
    }

    /// See `Step::norm`.
    pub(super) fn rosenbrock_error<const S: usize>(&self, table: &Table<S>, tolerance: f64) -> f64 {
        self.norm(tolerance, |i| {
            (0..S).map(|j| table.e[j] * self.k[1 + j][i]).sum()
        })
    }
}
