//! What a force of the controller on the head depends on.

use crate::{dynamics::kinematics::Kinematics, numeric::scalar::Scalar};
use nalgebra::Vector3;

/// What a force on the head depends on.
#[derive(Debug, Clone, Copy)]
pub struct HeadInput<'a, T: Scalar> {
    pub kin: &'a Kinematics<T>,
    /// The point psi of the head, from the pivot [m].
    pub head: Vector3<T>,
    /// Bodies moved by ankle, knee and hip, see `head_force`.
    pub leg: [usize; 3],
    /// Height of the pivot [m].
    pub z0: T,
}
