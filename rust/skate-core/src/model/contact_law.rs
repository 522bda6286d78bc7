//! The contact law of a scene, compiled. No other module reads `scene.contact`.

use crate::{
    model::contact_mode::{FREE, Foot, SoleContact},
    scene::{Contact, ContactLaw, PulledFriction},
};

/// Properties of the contact law.
#[derive(Debug, Clone, Copy)]
pub struct ContactRules {
    /// Normal forces only push, any end of a sole may touch, and either foot may leave the ice.
    /// Otherwise the paper's two-way constraints hold.
    pub is_push_only: bool,
    /// Two-way contact, by foot: friction vanishes while the foot's normal force pulls. If not, the normal
    /// force of Eq. 13 keeps its sign in the friction of the free foot. Push-only contact never pulls.
    pub friction_ends_when_pulled: [bool; 2],
    /// The supporting foot may rotate about an edge.
    pub support_rotates: bool,
    /// The free foot touches the ice. Otherwise it passes through.
    pub free_foot_touches: bool,
    /// The free toe may touch without the heel. Table 2 has no such state.
    pub free_toe_touches_alone: bool,
    /// Ends of a sole land. Otherwise a contact that has opened stays open.
    pub ends_land: bool,
    /// Two-way contact: a free foot on an edge leaves the ice where its normal force would pull.
    pub free_edge_lifts: bool,
    /// The free sole may become flat from below. In two-way contact without a contact of the toe alone
    /// the toe may be below the ice.
    pub free_toe_may_be_below: bool,
}

impl From<&Contact> for ContactRules {
    fn from(contact: &Contact) -> Self {
        let is_push_only = contact.law == ContactLaw::PushOnly;
        let literal = contact.pulled_friction == PulledFriction::Literal;
        let free_toe_touches_alone = contact.free_foot && (is_push_only || contact.toe_contact);
        Self {
            is_push_only,
            friction_ends_when_pulled: [!is_push_only, !is_push_only && !literal],
            support_rotates: contact.foot_rotation,
            free_foot_touches: contact.free_foot,
            free_toe_touches_alone,
            free_toe_may_be_below: !is_push_only && !free_toe_touches_alone,
            ends_land: contact.impacts,
            free_edge_lifts: !contact.point_contact_holds,
        }
    }
}

impl ContactRules {
    /// Does friction vanish while this foot, `SUPPORT` or `FREE`, is pulled? In two-way contact that of an edge always does,
    /// because it lifts.
    pub fn ends_friction_when_pulled(self, which: usize, foot: Foot) -> bool {
        let is_edge = matches!(foot.touch, SoleContact::Heel | SoleContact::Toe);
        let lifts = !self.is_push_only && which == FREE && is_edge && self.free_edge_lifts;
        self.friction_ends_when_pulled[which] || lifts
    }

    /// Does friction act on this foot also while it is pulled, which drives the foot?
    pub fn is_driven(self, which: usize) -> bool {
        !(self.is_push_only || self.friction_ends_when_pulled[which])
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
