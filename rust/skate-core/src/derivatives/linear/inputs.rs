//! What accelerations and contact forces depend on: the columns of their derivatives.

use crate::model::layout::{NV, ROOT};

/// Columns, without unused ones at the end: z0, q1, .. by position; y0, z0, q1, .. by velocity; the times of the
/// feedforward and of the arm swing; torques of the joints. No force depends on y0.
pub const COLUMNS: usize = 56;

/// Entries by coordinate and column.
pub type Rows = [[f64; COLUMNS]; NV];

/// Column of the position (not of y0), of the velocity and of the torque (not of the root) of a coordinate.
pub fn position(c: usize) -> usize {
    c - 1
}
pub fn velocity(n: usize, c: usize) -> usize {
    n - 1 + c
}
pub fn torque(n: usize, c: usize) -> usize {
    2 * n + 1 + c - ROOT
}

/// Number of columns in use.
pub fn columns(n: usize) -> usize {
    3 * n - 2
}

/// Columns of the times since the feedforward's phase began and since the leg swap.
pub fn times(n: usize) -> [usize; 2] {
    [2 * n - 1, 2 * n]
}
