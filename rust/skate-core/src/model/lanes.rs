//! Numbers of one model, or of several, one per SIMD lane.

use crate::{
    model::{Model, layout::TRUNK},
    numeric::{scalar::Scalar, spatial::SpatialInertia},
};

/// Numbers of a body that every evaluation reads.
#[derive(Debug, Clone, Copy, Default)]
pub struct Body<T = f64> {
    /// [kg]
    pub mass: T,
    /// Centre of mass in the body frame [m].
    pub com: [T; 3],
    /// Height of the joint above the parent's joint [m].
    pub above: T,
    /// Moments of inertia at the centre of mass, about x and about z [kg m2].
    pub across: T,
    pub along: T,
    /// Lateral distance of the limb's plane from its carrier [m].
    pub side: T,
}

/// One model, or one per lane, all of the same structure.
pub trait ModelLanes<T: Scalar>: Copy {
    /// The common structure.
    fn shape(&self) -> &Model;

    /// The model of a lane.
    fn lane(&self, i: usize) -> &Model;

    /// A number of every model.
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

    /// Inertia of a body of the trunk.
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

/// The same model in every lane.
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

/// A model for each lane; all have the same coordinates, effects and controller.
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
