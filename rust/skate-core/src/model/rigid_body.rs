//! Rigid bodies, their joints, and the line segments that picture them.

use nalgebra::{Matrix3, Vector3};

/// Direction of a joint's axis; the frames of parent and child agree when the joint is at zero.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Axis {
    X,
    Y,
    Z,
}

/// A rigid body and the joint that carries it, upright pose, frames parallel to the world's.
#[derive(Debug, Clone)]
pub struct RigidBody {
    /// Name of the link it grew from.
    pub name: &'static str,
    /// Index of the parent; the foot on the ice is its own.
    pub parent: usize,
    /// Axis of its joint.
    pub axis: Axis,
    /// Its joint in the parent's frame [m]. Body 0: the ankle is the origin.
    pub offset: Vector3<f64>,
    /// [kg]
    pub mass: f64,
    /// Centre of mass in its own frame [m].
    pub com: Vector3<f64>,
    /// About its centre of mass, in its own frame [kg m2].
    pub inertia: Matrix3<f64>,
    /// Viscous friction of its joint [N m s/rad].
    pub damping: f64,
}

/// One of the paper's 17 links, as a line to draw.
#[derive(Debug, Clone)]
pub struct Segment {
    /// Body that carries it.
    pub body: usize,
    /// Ends in that body's frame [m].
    pub ends: [Vector3<f64>; 2],
}
