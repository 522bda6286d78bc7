//! Time integration. Methods know a right-hand side and nothing of robots.

pub mod dopri5;

use crate::error::EndCause;

/// dy/dt = f(t, y) on at most `N` components.
pub trait Flow<const N: usize> {
    /// # Errors
    /// The right-hand side does not exist at (t, y).
    fn rhs(&mut self, t: f64, y: &[f64; N], dy: &mut [f64; N]) -> Result<(), EndCause>;
}
