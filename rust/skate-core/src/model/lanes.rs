//! The numbers of one robot, or of one in every lane.

use crate::{
    model::{Model, layout::TRUNK},
    numeric::{scalar::Scalar, spatial::SpatialInertia},
};

/// What every evaluation reads of a body.
#[derive(Debug, Clone, Copy, Default)]
pub struct Body<T = f64> {
    /// [kg]
    pub mass: T,
    /// Centre of mass in its own frame [m].
    pub com: [T; 3],
    /// Height of its joint above the parent's [m].
    pub above: T,
    /// Moments of inertia about its centre of mass, about x and about z [kg m2].
    pub across: T,
    pub along: T,
    /// Distance of its limb's plane beside the body that carries it [m].
    pub side: T,
}

/// One robot, or as many of the same structure as there are lanes.
pub trait ModelLanes<T: Scalar>: Copy {
    /// What all of them have in common.
    fn shape(&self) -> &Model;

    /// The robot of a lane.
    fn lane(&self, i: usize) -> &Model;

    /// A number of each.
    fn number(&self, of: impl Fn(&Model) -> f64) -> T;

    #[inline(always)]
    fn body(&self, b: usize) -> Body<T> {
        Body {
            mass: self.number(|m| m.numbers[b].mass),
            com: [
                self.number(|m| m.numbers[b].com[0]),
                self.number(|m| m.numbers[b].com[1]),
                self.number(|m| m.numbers[b].com[2]),
            ],
            above: self.number(|m| m.numbers[b].above),
            across: self.number(|m| m.numbers[b].across),
            along: self.number(|m| m.numbers[b].along),
            side: self.number(|m| m.numbers[b].side),
        }
    }

    /// Inertia of one of the trunk's bodies.
    #[inline(always)]
    fn trunk(&self, i: usize) -> SpatialInertia<T> {
        let mut inertia = SpatialInertia::default();
        let i = i.min(TRUNK - 1);
        for r in 0..3 {
            for c in 0..3 {
                inertia.n[r][c] = self.number(|m| m.trunk[i].n[r][c]);
                inertia.h[r][c] = self.number(|m| m.trunk[i].h[r][c]);
                inertia.f[r][c] = self.number(|m| m.trunk[i].f[r][c]);
            }
        }
        inertia
    }
}

impl ModelLanes<f64> for &Model {
    #[inline(always)]
    fn shape(&self) -> &Model {
        self
    }

    #[inline(always)]
    fn lane(&self, _: usize) -> &Model {
        self
    }

    #[inline(always)]
    fn number(&self, of: impl Fn(&Model) -> f64) -> f64 {
        of(self)
    }
}

/// The same robot in every lane.
#[derive(Debug, Clone, Copy)]
pub struct Broadcast<'a>(pub &'a Model);

impl<T: Scalar> ModelLanes<T> for Broadcast<'_> {
    #[inline(always)]
    fn shape(&self) -> &Model {
        self.0
    }

    #[inline(always)]
    fn lane(&self, _: usize) -> &Model {
        self.0
    }

    #[inline(always)]
    fn number(&self, of: impl Fn(&Model) -> f64) -> T {
        T::of(of(self.0))
    }
}

/// A robot for each lane; all have the same coordinates, effects and controller.
#[derive(Debug, Clone, Copy)]
pub struct PerLane<'a>(pub &'a [&'a Model]);

impl<T: Scalar> ModelLanes<T> for PerLane<'_> {
    #[inline(always)]
    fn shape(&self) -> &Model {
        self.0[0]
    }

    #[inline(always)]
    fn lane(&self, i: usize) -> &Model {
        self.0[i]
    }

    #[inline(always)]
    fn number(&self, of: impl Fn(&Model) -> f64) -> T {
        T::from_lanes(|i| of(self.0[i]))
    }
}
