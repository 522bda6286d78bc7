//! Transition rules of two-way contact, as the table that the engine runs on.
//!
//! The paper's Fig. 3, which shows them, is lost; the rules are this project's own. `Guards` monitors the guards
//! of the rules that start from the present contacts, and `EventHandler` follows the rule whose guard triggers.

use crate::{
    events::guard::Guard,
    model::{
        contact_law::ContactRules,
        contact_mode::{End, FREE, SUPPORT, SoleContact},
    },
};

/// One rule: in the contacts `from`, a zero of `guard` leads to the contacts `to`, both (support, free).
/// `None` stands for any contact of that foot, which then does not change. Each foot on the ice may also change
/// between sliding and sticking, which completes the rules to transitions between the 20 states of Table 2.
#[derive(Debug, Clone, Copy)]
pub struct Edge {
    pub guard: Guard,
    pub from: (Option<SoleContact>, Option<SoleContact>),
    pub to: (Option<SoleContact>, Option<SoleContact>),
    /// The feet exchange their roles; `to` is given in the new roles.
    pub swap: bool,
}

impl Edge {
    /// Does the rule start from these contacts?
    pub fn starts_from(&self, (support, free): (SoleContact, SoleContact)) -> bool {
        self.from.0.is_none_or(|touch| touch == support)
            && self.from.1.is_none_or(|touch| touch == free)
    }

    /// The contacts after the transition from these contacts.
    pub fn target(
        &self,
        (support, free): (SoleContact, SoleContact),
    ) -> (SoleContact, SoleContact) {
        (self.to.0.unwrap_or(support), self.to.1.unwrap_or(free))
    }

    /// Does the scene's contact law contain the rule?
    pub fn is_enabled(&self, contact: ContactRules) -> bool {
        match (self.guard, self.from.1) {
            (Guard::Gap(FREE, End::Toe), Some(SoleContact::Air)) => {
                contact.ends_land && contact.free_toe_touches_alone
            }
            (Guard::Gap(FREE, _), _) => contact.ends_land && contact.free_foot_touches,
            (Guard::Gap(..), _) => contact.ends_land,
            (Guard::Load(FREE, _), _) => contact.free_edge_lifts,
            (Guard::Load(SUPPORT, End::Heel), _) => contact.support_rotates,
            _ => true,
        }
    }
}

const fn edge(
    guard: Guard,
    from: (Option<SoleContact>, Option<SoleContact>),
    to: (Option<SoleContact>, Option<SoleContact>),
) -> Edge {
    Edge {
        guard,
        from,
        to,
        swap: false,
    }
}

/// The rules of two-way contact. The supporting foot leaves the ice only while the free foot is flat. A flat free
/// foot never leaves the ice. Table 2 has no state with the free toe alone: the rules from and to `Toe` of the
/// free foot apply to scenes with `toe_contact`. A supporting foot on its heel occurs only at a start of the
/// motion, and no rule lets it leave that contact.
pub const EDGES: [Edge; 9] = {
    use SoleContact::{Air, Flat, Heel, Toe};
    const ANY: Option<SoleContact> = None;
    const HEEL_LANDS: Guard = Guard::Gap(FREE, End::Heel);
    const TOE_LANDS: Guard = Guard::Gap(FREE, End::Toe);
    const HEEL_LIFTS: Guard = Guard::Load(FREE, End::Heel);
    const TOE_LIFTS: Guard = Guard::Load(FREE, End::Toe);
    const ROLL_BEGINS: Guard = Guard::Load(SUPPORT, End::Heel);
    const ROLL_ENDS: Guard = Guard::Gap(SUPPORT, End::Heel);
    [
        edge(HEEL_LANDS, (ANY, Some(Air)), (ANY, Some(Heel))),
        edge(TOE_LANDS, (ANY, Some(Air)), (ANY, Some(Toe))),
        edge(TOE_LANDS, (ANY, Some(Heel)), (ANY, Some(Flat))),
        edge(HEEL_LIFTS, (ANY, Some(Heel)), (ANY, Some(Air))),
        edge(HEEL_LANDS, (ANY, Some(Toe)), (ANY, Some(Flat))),
        edge(TOE_LIFTS, (ANY, Some(Toe)), (ANY, Some(Air))),
        edge(
            ROLL_BEGINS,
            (Some(Flat), Some(Flat)),
            (Some(Toe), Some(Flat)),
        ),
        Edge {
            guard: Guard::Load(SUPPORT, End::Toe),
            from: (Some(Toe), Some(Flat)),
            to: (Some(Flat), Some(Air)),
            swap: true,
        },
        edge(ROLL_ENDS, (Some(Toe), ANY), (Some(Flat), ANY)),
    ]
};
