//! The contact law of a scene, compiled. No other module reads `scene.contact`.

use crate::{
    model::contact_mode::{FREE, SoleContact},
    scene::{Contact, ContactLaw, PulledFriction},
};

/// Properties of the contact law.
#[derive(Debug, Clone, Copy)]
pub struct ContactRules {
    is_push_only: bool,
    /// By foot; see `friction_ends_when_pulled`.
    friction_ends_when_pulled: [bool; 2],
    support_rotates: bool,
    free_foot_touches: bool,
    free_toe_touches_alone: bool,
    ends_land: bool,
    free_edge_lifts: bool,
}

impl From<&Contact> for ContactRules {
    fn from(contact: &Contact) -> Self {
        let is_push_only = contact.law == ContactLaw::PushOnly;
        let literal = contact.pulled_friction == PulledFriction::Literal;
        Self {
            is_push_only,
            friction_ends_when_pulled: [!is_push_only, !is_push_only && !literal],
            support_rotates: contact.foot_rotation,
            free_foot_touches: contact.free_foot,
            free_toe_touches_alone: contact.free_foot && (is_push_only || contact.toe_contact),
            ends_land: contact.impacts,
            free_edge_lifts: !contact.point_contact_holds,
        }
    }
}

impl ContactRules {
    /// Normal forces only push, any end of a sole may touch, and either foot may leave the ice.
    /// Otherwise the paper's two-way constraints hold.
    #[inline(always)]
    pub fn is_push_only(self) -> bool {
        self.is_push_only
    }

    /// Two-way contact: does friction vanish while the foot's normal force pulls? If not, the normal
    /// force of Eq. 13 keeps its sign in the friction of the free foot. Push-only contact never pulls.
    #[inline(always)]
    pub fn friction_ends_when_pulled(self, which: usize) -> bool {
        self.friction_ends_when_pulled[which]
    }

    /// May the supporting foot rotate about an edge?
    #[inline(always)]
    pub fn support_rotates(self) -> bool {
        self.support_rotates
    }

    /// Does the free foot touch the ice? Otherwise it passes through.
    #[inline(always)]
    pub fn free_foot_touches(self) -> bool {
        self.free_foot_touches
    }

    /// May the free toe touch without the heel? Table 2 has no such state.
    #[inline(always)]
    pub fn free_toe_touches_alone(self) -> bool {
        self.free_toe_touches_alone
    }

    /// Do ends of a sole land? Otherwise a contact that has opened stays open.
    #[inline(always)]
    pub fn ends_land(self) -> bool {
        self.ends_land
    }

    /// Two-way contact: does a free foot on an edge leave the ice where its normal force would pull?
    #[inline(always)]
    pub fn free_edge_lifts(self) -> bool {
        self.free_edge_lifts
    }

    /// May the free sole become flat from below? In two-way contact without a contact of the toe alone
    /// the toe may be below the ice.
    #[inline(always)]
    pub fn free_toe_may_be_below(self) -> bool {
        !self.is_push_only && !self.free_toe_touches_alone
    }

    /// The contacts of a foot, `SUPPORT` or `FREE`, that are possible.
    pub fn allowed_contacts(self, which: usize) -> &'static [SoleContact] {
        use SoleContact::{Air, Flat, Heel, Toe};
        if which == FREE {
            match (self.free_foot_touches, self.free_toe_touches_alone) {
                (false, _) => &[Air],
                (true, false) => &[Air, Flat, Heel],
                (true, true) => &[Air, Flat, Heel, Toe],
            }
        } else {
            match (self.is_push_only, self.support_rotates) {
                (true, _) => &[Air, Flat, Heel, Toe],
                (false, true) => &[Flat, Heel, Toe],
                (false, false) => &[Flat],
            }
        }
    }
}
