//! Lanes in which the contact modes of a step satisfy a condition.

use crate::{
    contact::equations::{PHI, Y},
    model::{
        contact_mode::{ContactMode, SoleContact},
        lanes::ModelLanes,
    },
    numeric::scalar::{Mask, Scalar},
    time_stepping::step_contacts::StepContacts,
};

impl<T: Scalar, R: ModelLanes<T>> StepContacts<'_, T, R> {
    /// Lanes without an error whose modes at the start and at the end satisfy a condition.
    #[inline(always)]
    fn lanes_where(&self, condition: impl Fn(ContactMode, ContactMode) -> bool) -> T::Mask {
        T::Mask::from_lanes(|i| self.outcomes[i].is_ok_and(|end| condition(self.starts[i], end)))
    }

    /// Lanes in which the free foot, on the ice, has begun to stick.
    #[inline(always)]
    pub fn newly_stuck(&self) -> T::Mask {
        self.lanes_where(|start, end| !end.free.slides() && end.free != start.free)
    }

    /// Lanes in which the free foot sticks during the whole step. Its velocity is an error of the constraints.
    #[inline(always)]
    pub fn free_foot_rests(&self) -> T::Mask {
        self.lanes_where(|start, end| !end.free.slides() && !start.free.slides())
    }

    /// Lanes in flight.
    #[inline(always)]
    pub fn in_flight(&self) -> T::Mask {
        self.lanes_where(|_, end| end.is_flight())
    }

    /// Lanes in which no foot sticks.
    #[inline(always)]
    pub fn sticking_nowhere(&self) -> T::Mask {
        self.lanes_where(|_, end| end.sticks_nowhere())
    }

    /// Lanes with the supporting foot on the ice.
    #[inline(always)]
    pub fn supported(&self) -> T::Mask {
        self.lanes_where(|_, end| end.support.touch != SoleContact::Air)
    }

    /// Active lanes with the free foot on the ice.
    #[inline(always)]
    pub fn touching(&self) -> T::Mask {
        self.active & self.lanes_where(|_, end| end.free.touch != SoleContact::Air)
    }

    /// Lanes with the supporting foot on its heel.
    #[inline(always)]
    pub fn on_heel(&self) -> T::Mask {
        self.lanes_where(|_, end| end.support.touch == SoleContact::Heel)
    }

    /// 1 where contact constrains the free foot's y, z, rotation, else 0.
    #[inline(always)]
    pub fn held(&self) -> [T; 3] {
        let one = |mask| T::select(mask, T::one(), T::zero());
        let mut held = [T::one(); 3];
        held[Y] = one(self.lanes_where(|_, end| !end.free.slides()));
        held[PHI] = one(self.lanes_where(|_, end| end.free.touch == SoleContact::Flat));
        held
    }
}
