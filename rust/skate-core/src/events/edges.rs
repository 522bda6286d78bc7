//! Fig. 3 as a table.

use crate::{
    events::guards::Guard,
    model::contact_mode::{End, FREE, SUPPORT, SoleContact},
};

/// One arrow of Fig. 3 between the touches of the feet; sliding and sticking, which any foot on the
/// ice may change, complete it to the arrows between the 20 states.
#[derive(Debug, Clone, Copy)]
pub struct Edge {
    pub guard: Guard,
    /// Touches (support, free) before and after.
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

/// The arrows of two-way contact. The supporting foot lets go only while the free foot is flat; a flat
/// free foot never lets go. The free toe alone has no state in Table 2: its arrows, the last six, are
/// those of a scene with `toe_contact`.
pub const EDGES: [Edge; 17] = {
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
    ]
};
