//! Feet that are stepped without friction, because it would add energy.
//!
//! The direction of friction is that of the new velocity, its work that of the mean velocity. They differ where a foot
//! reverses, or stops and is then held against a force in the direction in which it came. Which part of the step it
//! slides in which direction is unknown, so that the velocity has an error of order h with friction, too.

use crate::{
    contact::equations::{Slip, Solution, Y, Z},
    model::{
        contact_mode::{ContactMode, FREE, SUPPORT, SoleContact},
        friction::FrictionMode,
        lanes::ModelLanes,
    },
    numeric::scalar::{Mask, Scalar},
    time_stepping::step_contacts::StepContacts,
};

/// Work that friction may do on a foot in a step, divided by the square of its length [J/s2]. Velocities of a foot that
/// lands, or is held in place, have errors that do such work.
const MOST_GAINED: f64 = 1.0;

impl<T: Scalar, R: ModelLanes<T>> StepContacts<'_, T, R> {
    /// Friction coefficients of a mode in this step.
    #[inline(always)]
    pub(super) fn slip(&self, mode: ContactMode) -> Slip<T> {
        let Slip { support, free } = Slip::of(self.models, mode);
        let [at_support, at_free] = self.frictionless;
        Slip {
            support: T::select(at_support, T::zero(), support),
            free: T::select(at_free, T::zero(), free),
        }
    }

    /// Leave out the friction of feet on which it would do work, and return whether there are more of them than before.
    /// `old` and `new` are the velocities of the feet along the ice at the start and at the end of the step of length `h`.
    #[inline(always)]
    pub fn drop_driving_friction(
        &mut self,
        solution: &Solution<T>,
        (old, new): ([T; 2], [T; 2]),
        h: T,
    ) -> bool {
        let (half, most) = (T::of(0.5), T::of(MOST_GAINED) * h * h);
        let impulses = [solution.f_root[Y], solution.lam[Y]];
        let driven = [SUPPORT, FREE].map(|which| {
            let mean = half * (old[which] + new[which]);
            // A step whose mode is fixed may end with a velocity against the mode.
            let work = (impulses[which] * mean).simd_max(impulses[which] * new[which]);
            most.lt(work) & self.active & !self.frictionless[which]
        });
        (driven[SUPPORT] | driven[FREE]).any() && self.drop_friction(driven, solution, old)
    }

    #[inline(never)]
    fn drop_friction(&mut self, driven: [T::Mask; 2], solution: &Solution<T>, old: [T; 2]) -> bool {
        let normal = [solution.f_root[Z], solution.lam[Z]];
        let mut any = false;
        for (i, which) in (0..T::LANES).flat_map(|i| [(i, SUPPORT), (i, FREE)]) {
            let Ok(mode) = self.outcomes[i] else {
                continue;
            };
            let (normal, old) = (normal[which].lane(i), old[which].lane(i));
            if driven[which].lane(i)
                && let Some(mode) = self.without_friction(i, which, mode, (normal, old))
            {
                self.outcomes[i] = Ok(mode);
                self.frictionless[which] = self.frictionless[which] | T::Mask::only(i);
                any = true;
            }
        }
        any
    }

    /// The mode in which a foot of a lane goes on without friction; None where it keeps its friction. `normal` is its
    /// impulse, and `old` its velocity along the ice at the start.
    fn without_friction(
        &self,
        i: usize,
        which: usize,
        mode: ContactMode,
        (normal, old): (f64, f64),
    ) -> Option<ContactMode> {
        let foot = mode.foot(which);
        let is_printed = self.models.lane(i).contact.is_driven(which) && normal < 0.0;
        let stops = which == SUPPORT || self.starts[i].foot(which).slides();
        if foot.touch == SoleContact::Air {
            // The impulse is a rounding error.
            None
        } else if foot.slides() {
            (!is_printed).then_some(mode)
        } else if stops {
            // Without friction the foot goes on against its old velocity.
            Some(mode.with_sliding(which, FrictionMode::of(-old, 0.0)))
        } else {
            // The velocity of a free foot that was at rest is an error of the constraints.
            None
        }
    }
}
