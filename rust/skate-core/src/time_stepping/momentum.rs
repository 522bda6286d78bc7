//! The momentum at the end of a step: that at the start and the impulses of all external forces.
//!
//! Forces are evaluated at the middle of a step, so that its equations give A(q') v' = A(q) v + impulses only up to
//! h^3, where A is the matrix of the momentum. Without correction a robot in the air pushes itself off nothing.
//!
//! Where no foot sticks, a translation of the root along y is free, in flight any rigid motion. It is chosen so that
//! the momentum is exact, and so that the centre of mass moves by the mean of its velocities.

use crate::{
    contact::equations::{PHI, Solution, Y, Z},
    dynamics::centre_of_mass::{CentreOfMass, InnerMotion},
    model::{
        Model,
        lanes::ModelLanes,
        layout::{NV, ROOT},
    },
    numeric::scalar::Scalar,
};

/// State at the start or at the end of a step.
#[derive(Debug, Clone, Copy)]
pub struct Motion<T> {
    pub q: [T; NV],
    pub v: [T; NV],
    /// Position y at which a free foot sticks [m].
    pub anchor: T,
    pub centre: CentreOfMass<T>,
    /// Work of the actuators, and energy dissipated by damping and by friction [J]; see `EnergyBalance`.
    pub energies: [T; 3],
}

impl<T: Scalar> Default for Motion<T> {
    fn default() -> Self {
        Self {
            q: [T::zero(); NV],
            v: [T::zero(); NV],
            anchor: T::zero(),
            centre: CentreOfMass::zero(),
            energies: [T::zero(); 3],
        }
    }
}

/// Lanes in which momentum is restored.
#[derive(Debug, Clone, Copy)]
pub(super) struct Restored<M> {
    /// Along y: no foot sticks.
    pub along: M,
    /// Along z and the angular momentum, too: in flight.
    pub all: M,
}

impl<T: Scalar> Motion<T> {
    /// Change the root's motion at the end so that the momentum is that at the `start` and the impulses of the external
    /// forces: gravity, and `tau` on the root [N], [N m], the friction of the ice and of the sole in a `solution`.
    #[inline(always)]
    pub(super) fn restore_momentum(
        &mut self,
        models: impl ModelLanes<T>,
        (inner, lanes): (&InnerMotion<T>, Restored<T::Mask>),
        (start, h): (&Self, T),
        (tau, solution): ([T; ROOT], &Solution<T>),
    ) {
        let (mass, half) = (models.number(Model::mass), T::of(0.5));
        let applied = |i: usize| {
            let damping = models.number(|m| m.damping[i]);
            h * (tau[i] - damping * (half * (start.v[i] + self.v[i])))
        };
        let (before, after) = (&start.centre, inner.at);
        let along = applied(Y) + solution.f_root[Y] + solution.lam[Y];
        // In flight the friction along y is zero, and a couple on the foot has the same moment about all points.
        let rate = inner.rate_for(before.spin + applied(PHI));
        let fall = h * models.number(|m| m.scene.ice.gravity);
        self.v[PHI] = T::select(lanes.all, rate, self.v[PHI]);
        let velocity = [before.velocity[Y] + along / mass, before.velocity[Z] - fall];
        let speeds = inner.speeds_for(velocity, self.v[PHI]);
        for (i, lanes) in [(Y, lanes.along), (Z, lanes.all)] {
            let moved = half * h * (before.velocity[i] + velocity[i]);
            let q = start.q[i] + (before.at[i] - after[i]) + moved;
            self.v[i] = T::select(lanes, speeds[i], self.v[i]);
            self.q[i] = T::select(lanes, q, self.q[i]);
        }
    }
}
