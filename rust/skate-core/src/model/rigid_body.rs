//! Rigid bodies, their joints, and the line segments that represent them in drawings.

use nalgebra::{Matrix3, Vector3};

/// Axis of a joint. The frames of parent and child are parallel at joint angle zero.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Axis {
    X,
    Y,
    Z,
}

/// A rigid body and its joint. In the upright pose all frames are parallel to the world frame.
#[derive(Debug, Clone)]
pub struct RigidBody {
    /// Name of its first link.
    pub name: &'static str,
    /// Index of the parent; body 0, the supporting foot, is its own parent.
    pub parent: usize,
    /// Axis of its joint.
    pub axis: Axis,
    /// Joint in the parent's frame [m]; zero for body 0, whose origin is the ankle.
    pub offset: Vector3<f64>,
    /// [kg]
    pub mass: f64,
    /// Centre of mass in the body frame [m].
    pub com: Vector3<f64>,
    /// Inertia about the centre of mass, in the body frame [kg m2].
    pub inertia: Matrix3<f64>,
    /// Viscous friction of its joint [N m s/rad].
    pub damping: f64,
}

/// One of the paper's 17 links as a line segment.
#[derive(Debug, Clone)]
pub struct Segment {
    /// Body that carries it.
    pub body: usize,
    /// Ends in that body's frame [m].
    pub ends: [Vector3<f64>; 2],
}
