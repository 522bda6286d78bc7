//! Transition rules of two-way contact as a table.
//!
//! The paper's Fig. 3, which shows them, is lost. The rules are this project's own. `Guards` watches the
//! guards of these rules and `EventHandler` looks loads up here; a test compares every rule with the
//! guards of every scene option.

use crate::{
    events::guards::Guard,
    model::contact_mode::{End, FREE, SUPPORT, SoleContact},
};

/// One rule: in the contacts `from`, a zero of `guard` leads to the contacts `to`. Each foot on the ice
/// may also change between sliding and sticking, which completes the rules to transitions between the
/// 20 states of Table 2.
#[derive(Debug, Clone, Copy)]
pub struct Edge {
    pub guard: Guard,
    /// Contacts (support, free) before and after.
    pub from: (SoleContact, SoleContact),
    pub to: (SoleContact, SoleContact),
    /// The feet exchange their names; `to` is what follows under the new names.
    pub swap: bool,
}

const fn edge(
    guard: Guard,
    from: (SoleContact, SoleContact),
    to: (SoleContact, SoleContact),
) -> Edge {
    Edge {
        guard,
        from,
        to,
        swap: false,
    }
}

/// The rules of two-way contact. The supporting foot leaves the ice only while the free foot is flat. A
/// flat free foot never leaves the ice. Table 2 has no state with the free toe alone: the last seven
/// rules apply to scenes with `toe_contact`. A supporting foot on its heel occurs only at a start
/// of the motion. The table has no rule for it; if it is to leave the ice, the motion ends with `Jam`.
pub const EDGES: [Edge; 18] = {
    use SoleContact::{Air, Flat, Heel, Toe};
    [
        edge(Guard::Gap(FREE, End::Heel), (Flat, Air), (Flat, Heel)),
        edge(Guard::Gap(FREE, End::Heel), (Toe, Air), (Toe, Heel)),
        edge(Guard::Gap(FREE, End::Toe), (Flat, Heel), (Flat, Flat)),
        edge(Guard::Gap(FREE, End::Toe), (Toe, Heel), (Toe, Flat)),
        edge(Guard::Load(FREE, End::Heel), (Flat, Heel), (Flat, Air)),
        edge(Guard::Load(FREE, End::Heel), (Toe, Heel), (Toe, Air)),
        edge(Guard::Load(SUPPORT, End::Heel), (Flat, Flat), (Toe, Flat)),
        edge(Guard::Gap(SUPPORT, End::Heel), (Toe, Air), (Flat, Air)),
        edge(Guard::Gap(SUPPORT, End::Heel), (Toe, Heel), (Flat, Heel)),
        edge(Guard::Gap(SUPPORT, End::Heel), (Toe, Flat), (Flat, Flat)),
        Edge {
            guard: Guard::Load(SUPPORT, End::Toe),
            from: (Toe, Flat),
            to: (Flat, Air),
            swap: true,
        },
        edge(Guard::Gap(FREE, End::Toe), (Flat, Air), (Flat, Toe)),
        edge(Guard::Gap(FREE, End::Toe), (Toe, Air), (Toe, Toe)),
        edge(Guard::Gap(FREE, End::Heel), (Flat, Toe), (Flat, Flat)),
        edge(Guard::Gap(FREE, End::Heel), (Toe, Toe), (Toe, Flat)),
        edge(Guard::Load(FREE, End::Toe), (Flat, Toe), (Flat, Air)),
        edge(Guard::Load(FREE, End::Toe), (Toe, Toe), (Toe, Air)),
        edge(Guard::Gap(SUPPORT, End::Heel), (Toe, Toe), (Flat, Toe)),
    ]
};
