//! Time integration. Methods know a system as a few functions, and nothing of robots.

pub mod dopri5;
pub mod rk4;
pub mod rosenbrock;
mod step;

pub use step::Step;

use crate::error::EndCause;
use serde::{Deserialize, Serialize};

/// How a motion is integrated.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[serde(tag = "method", rename_all = "snake_case", deny_unknown_fields)]
pub enum Method {
    /// Explicit, order 5, error-controlled; `tolerance` is relative.
    Dopri5 { tolerance: f64 },
    /// Explicit, order 4, steps of fixed length [s].
    Rk4 { step: f64 },
    /// Linearly implicit, order 3, error-controlled.
    Rosenbrock { tolerance: f64 },
}

impl Method {
    /// Length of its steps, if that is fixed [s].
    pub fn step(self) -> Option<f64> {
        match self {
            Self::Rk4 { step } => Some(step),
            Self::Dopri5 { .. } | Self::Rosenbrock { .. } => None,
        }
    }

    /// Relative tolerance of a step; 0 where steps are fixed.
    pub fn tolerance(self) -> f64 {
        match self {
            Self::Dopri5 { tolerance } | Self::Rosenbrock { tolerance } => tolerance,
            Self::Rk4 { .. } => 0.0,
        }
    }

    /// Does it ask for `System::factor`?
    pub fn is_implicit(self) -> bool {
        matches!(self, Self::Rosenbrock { .. })
    }

    /// Factor for the next step after an error (1 = tolerance); safety 0.9, 0.2 to 5.
    pub fn step_factor(self, error: f64) -> f64 {
        let order = match self {
            Self::Dopri5 { .. } => 5.0,
            Self::Rosenbrock { .. } => 3.0,
            Self::Rk4 { .. } => return 1.0,
        };
        (0.9 * error.max(1e-10).powf(-1.0 / order)).clamp(0.2, 5.0)
    }
}

impl<const N: usize> Step<N> {
    /// Advance from `start`, which is t, y and the right-hand side there, by `h`. The system was last
    /// evaluated at the start, if the method is implicit, and is evaluated at the end afterwards.
    ///
    /// # Errors
    /// Those of the system.
    pub fn attempt(
        &mut self,
        method: Method,
        system: &mut impl System<N>,
        start: (f64, &[f64; N], &[f64; N]),
        h: f64,
    ) -> Result<(), EndCause> {
        match method {
            Method::Dopri5 { .. } => self.dopri5(system, start, h),
            Method::Rk4 { .. } => self.rk4(system, start, h),
            Method::Rosenbrock { .. } => self.rosenbrock(system, start, h),
        }
    }

    /// Local error as a multiple of the tolerance; 0 where steps are fixed.
    pub fn error(&self, method: Method) -> f64 {
        match method {
            Method::Dopri5 { tolerance } => self.dopri5_error(tolerance),
            Method::Rosenbrock { tolerance } => self.rosenbrock_error(tolerance),
            Method::Rk4 { .. } => 0.0,
        }
    }

    /// Prepare `at`.
    pub fn make_dense(&mut self, method: Method) {
        match method {
            Method::Dopri5 { .. } => self.dopri5_dense(),
            Method::Rk4 { .. } | Method::Rosenbrock { .. } => self.cubic(),
        }
    }
}

/// Smooth motion between events, dy/dt = f(t, y) on at most `N` components.
pub trait System<const N: usize> {
    /// dy := f(t, y).
    ///
    /// # Errors
    /// The right-hand side does not exist at (t, y).
    fn rhs(&mut self, t: f64, y: &[f64; N], dy: &mut [f64; N]) -> Result<(), EndCause>;

    /// Prepare `solve` with the matrix I - g A, where A approximates the stiff part of df/dy at the
    /// state that `rhs` has just seen. Explicit methods never ask.
    ///
    /// # Errors
    /// The matrix is singular.
    fn factor(&mut self, g: f64) -> Result<(), EndCause>;

    /// x := (I - g A)^-1 x.
    ///
    /// # Errors
    /// As for `factor`.
    fn solve(&mut self, x: &mut [f64; N]) -> Result<(), EndCause>;
}
