//! Layout of coordinates and bodies.

use crate::numeric::scalar::Scalar;

/// Most coordinates: y0, z0, q1 and the 16 joints.
pub const NV: usize = 19;
/// Most rigid bodies.
pub const NB: usize = crate::numeric::trig::MAX_ANGLES;
/// Most joints of the trunk.
pub const TRUNK: usize = 3;
/// Coordinates of the root: y0, z0, q1.
pub const ROOT: usize = 3;
/// Longest path from the root to a leaf, in coordinates (y0 z0 q1 q2 q3 q4 q8 .. q13).
pub const DEPTH: usize = 12;

/// Bodies that are always there, by index; see `Model::bodies`.
pub const LOWER_LEG: usize = 1;
pub const UPPER_LEG: usize = 2;
pub const WAIST: usize = 3;
pub const FREE_LOWER_LEG: usize = 5;
pub const FREE_FOOT: usize = 6;
/// Index of the coordinate that moves body `b`: q1 turns body 0.
pub const fn coordinate(body: usize) -> usize {
    body + 2
}

/// Coordinates that move the free foot: the root and q2 to q7, each the next one's parent.
pub const LEG: usize = 9;

/// q2 .. q7, their rates or their torques, counted from the other foot: the chain runs backwards and
/// every relative angle changes its sign.
pub fn reverse_legs<T: Scalar>(x: &mut [T; NV]) {
    let legs = &mut x[ROOT..ROOT + 6];
    legs.reverse();
    legs.iter_mut().for_each(|angle| *angle = -*angle);
}
