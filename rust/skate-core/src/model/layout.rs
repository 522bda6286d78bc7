//! Layout of coordinates and bodies.

use crate::numeric::scalar::Scalar;

/// Maximum number of coordinates: y0, z0, q1 and the 16 joints.
pub const NV: usize = 19;
/// Maximum number of rigid bodies.
pub const NB: usize = crate::numeric::trig::MAX_ANGLES;
/// Maximum number of joints of the trunk.
pub const TRUNK: usize = 3;
/// Coordinates of the root: y0, z0, q1.
pub const ROOT: usize = 3;
/// Longest path from the root to a leaf, in coordinates (y0 z0 q1 q2 q3 q4 q8 .. q13).
pub const DEPTH: usize = 12;

/// Indices of the bodies that every model has; see `Model::bodies`.
pub const LOWER_LEG: usize = 1;
pub const UPPER_LEG: usize = 2;
pub const WAIST: usize = 3;
pub const FREE_LOWER_LEG: usize = 5;
pub const FREE_FOOT: usize = 6;
/// Index of the coordinate of body `b`; that of body 0 is q1.
pub const fn coordinate(body: usize) -> usize {
    body + 2
}

/// Coordinates that move the free foot: the root and q2 to q7, a chain.
pub const LEG: usize = 9;

/// Reorder q2 .. q7, their rates or their torques for the other supporting foot: the order is reversed and every
/// relative angle changes its sign.
pub fn reverse_legs<T: Scalar>(x: &mut [T; NV]) {
    let legs = &mut x[ROOT..ROOT + 6];
    legs.reverse();
    legs.iter_mut().for_each(|angle| *angle = -*angle);
}
