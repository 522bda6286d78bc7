//! The classical Runge-Kutta method of order 4 (Kutta 1901), with cubic Hermite dense output.

use crate::{
    error::Termination,
    integrate::{Step, System, step::LAST},
};

pub const C: [f64; 4] = [0.0, 0.5, 0.5, 1.0];
pub const A: [[f64; 3]; 4] = [[0.0; 3], [0.5, 0.0, 0.0], [0.0, 0.5, 0.0], [0.0, 0.0, 1.0]];
pub const B: [f64; 4] = [1.0 / 6.0, 1.0 / 3.0, 1.0 / 3.0, 1.0 / 6.0];

impl<const N: usize> Step<N> {
    /// As `dopri5`.
    pub(super) fn rk4(
        &mut self,
        system: &mut impl System<N>,
        start: (f64, &[f64; N], &[f64; N]),
        h: f64,
    ) -> Result<(), Termination> {
        self.start(start, h);
        for s in 1..4 {
            self.combine(A[s]);
            system.rhs(self.t + C[s] * h, &self.y1, &mut self.k[s])?;
        }
        self.combine(B);
        system.rhs(self.t + h, &self.y1, &mut self.k[LAST])
    }
}
