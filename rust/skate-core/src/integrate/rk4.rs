//! The classical Runge-Kutta method of order 4 (Kutta 1901), with cubic Hermite dense output.

use crate::{
    error::Termination,
    integrate::{Start, System, TimeStep},
    numeric::scalar::Scalar,
};

/// Index of the slope at the end of the step.
const LAST: usize = 4;
pub const C: [f64; 4] = [0.0, 0.5, 0.5, 1.0];
pub const A: [[f64; 3]; 4] = [[0.0; 3], [0.5, 0.0, 0.0], [0.0, 0.5, 0.0], [0.0, 0.0, 1.0]];
pub const B: [f64; 4] = [1.0 / 6.0, 1.0 / 3.0, 1.0 / 3.0, 1.0 / 6.0];

impl<const N: usize, T: Scalar> TimeStep<N, T> {
    /// As `dopri5`.
    #[inline(always)]
    pub(super) fn rk4(
        &mut self,
        system: &mut impl System<N, T>,
        start: Start<'_, N, T>,
        h: T,
    ) -> Result<(), Termination> {
        self.start(start, h, LAST);
        for s in 1..4 {
            self.combine(A[s]);
            system.rhs(self.t + T::of(C[s]) * h, &self.y1, &mut self.k[s])?;
        }
        self.combine(B);
        system.rhs(self.t + h, &self.y1, &mut self.k[LAST])
    }
}
