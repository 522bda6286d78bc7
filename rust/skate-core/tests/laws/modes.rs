//! Table 2 and the table of transition rules.

use skate_core::{
    contact::equations::{PHI, Y, Z, multipliers, root_unknowns},
    events::{EDGES, guard::Guard, guards::Guards},
    model::{
        Model,
        contact_mode::{ContactMode, End, FREE, Foot, SUPPORT, SoleContact, TABLE_2, touches},
        friction::FrictionMode,
    },
    scene::Scene,
};

/// Every row of Table 2 belongs to exactly one pair of feet, `ContactMode::number` finds it, and the
/// contact equations have exactly the unknowns of that row.
#[test]
fn table_2_is_what_the_equations_solve() {
    let mut seen = [0; 21];
    for support in [SoleContact::Flat, SoleContact::Toe] {
        for friction_mode in [FrictionMode::Stuck, FrictionMode::Forward] {
            for free in [SoleContact::Air, SoleContact::Heel, SoleContact::Flat] {
                for free_grip in [FrictionMode::Stuck, FrictionMode::Forward] {
                    let mode = ContactMode {
                        support: Foot::new(support, friction_mode),
                        free: Foot::new(free, free_grip),
                    };
                    if free == SoleContact::Air && free_grip == FrictionMode::Forward {
                        continue;
                    }
                    let number = mode.number();
                    seen[number as usize] += 1;
                    let row = TABLE_2[number as usize - 1];
                    assert_eq!(row.number, number);
                    assert_eq!(row.y0, friction_mode != FrictionMode::Stuck);
                    assert_eq!(row.q1, support != SoleContact::Flat);
                    assert_eq!(row.f_nz, free != SoleContact::Air);
                    assert_eq!(row.tau_n, free == SoleContact::Flat);
                    assert_eq!(
                        row.f_ny,
                        free != SoleContact::Air && free_grip == FrictionMode::Stuck
                    );
                    let unknowns = |(components, n): ([usize; 3], usize)| {
                        [Y, Z, PHI].map(|component| components[..n].contains(&component))
                    };
                    assert_eq!(
                        unknowns(root_unknowns(mode.support)),
                        [row.y0, false, row.q1],
                        "state {number}"
                    );
                    assert_eq!(
                        unknowns(multipliers(mode.free)),
                        [row.f_ny, row.f_nz, row.tau_n],
                        "state {number}"
                    );
                }
            }
        }
    }
    assert!(seen[1..].iter().all(|&count| count == 1), "{seen:?}");
}

type Contacts = (SoleContact, SoleContact);

/// The transitions of two-way contact between pairs of contacts (support, free), written out; the last field
/// tells whether the legs swap.
const TRANSITIONS: [(Guard, Contacts, Contacts, bool); 18] = {
    use SoleContact::{Air, Flat, Heel, Toe};
    const FREE_HEEL_LANDS: Guard = Guard::Gap(FREE, End::Heel);
    const FREE_TOE_LANDS: Guard = Guard::Gap(FREE, End::Toe);
    const HEEL_LANDS: Guard = Guard::Gap(SUPPORT, End::Heel);
    const FREE_HEEL_LIFTS: Guard = Guard::Load(FREE, End::Heel);
    const FREE_TOE_LIFTS: Guard = Guard::Load(FREE, End::Toe);
    [
        (FREE_HEEL_LANDS, (Flat, Air), (Flat, Heel), false),
        (FREE_HEEL_LANDS, (Toe, Air), (Toe, Heel), false),
        (FREE_TOE_LANDS, (Flat, Heel), (Flat, Flat), false),
        (FREE_TOE_LANDS, (Toe, Heel), (Toe, Flat), false),
        (FREE_HEEL_LIFTS, (Flat, Heel), (Flat, Air), false),
        (FREE_HEEL_LIFTS, (Toe, Heel), (Toe, Air), false),
        (
            Guard::Load(SUPPORT, End::Heel),
            (Flat, Flat),
            (Toe, Flat),
            false,
        ),
        (HEEL_LANDS, (Toe, Air), (Flat, Air), false),
        (HEEL_LANDS, (Toe, Heel), (Flat, Heel), false),
        (HEEL_LANDS, (Toe, Flat), (Flat, Flat), false),
        (
            Guard::Load(SUPPORT, End::Toe),
            (Toe, Flat),
            (Flat, Air),
            true,
        ),
        (FREE_TOE_LANDS, (Flat, Air), (Flat, Toe), false),
        (FREE_TOE_LANDS, (Toe, Air), (Toe, Toe), false),
        (FREE_HEEL_LANDS, (Flat, Toe), (Flat, Flat), false),
        (FREE_HEEL_LANDS, (Toe, Toe), (Toe, Flat), false),
        (FREE_TOE_LIFTS, (Flat, Toe), (Flat, Air), false),
        (FREE_TOE_LIFTS, (Toe, Toe), (Toe, Air), false),
        (HEEL_LANDS, (Toe, Toe), (Flat, Toe), false),
    ]
};

/// The paper's cycle 3 -> 7 -> 15 -> 16 -> 14 -> 3 is a path along the edges.
#[test]
fn the_edges_contain_the_cycle_of_the_paper() {
    use SoleContact::{Air, Flat, Heel, Toe};
    let leads = |from, to, swap| {
        EDGES
            .iter()
            .any(|e| e.starts_from(from) && e.target(from) == to && e.swap == swap)
    };
    assert!(leads((Flat, Air), (Flat, Heel), false));
    assert!(leads((Flat, Heel), (Flat, Flat), false));
    assert!(leads((Flat, Flat), (Toe, Flat), false));
    assert!(leads((Toe, Flat), (Flat, Air), true));
}

/// For every scene option of two-way contact the engine follows exactly those of the transitions above that the
/// options allow.
#[test]
fn the_edges_are_the_transitions() {
    let mut followed = [false; TRANSITIONS.len()];
    for options in 0..32_u32 {
        let [
            foot_rotation,
            free_foot,
            toe_contact,
            impacts,
            point_contact_holds,
        ] = [0, 1, 2, 3, 4].map(|bit| options >> bit & 1 == 1);
        let scene = Scene::from_json(&format!(
            r#"{{"contact": {{"law": "two_way", "foot_rotation": {foot_rotation},
            "free_foot": {free_foot}, "toe_contact": {toe_contact}, "impacts": {impacts},
            "point_contact_holds": {point_contact_holds}, "edge_damping": 0}}}}"#
        ));
        let Some(model) = scene.ok().and_then(|scene| Model::compile(&scene).ok()) else {
            continue;
        };
        let contacts: Vec<_> = model.modes().into_iter().map(touches).collect();
        let is_allowed = |(guard, from, to, _): &(Guard, Contacts, Contacts, bool)| {
            let option = match guard {
                Guard::Gap(..) => impacts,
                Guard::Load(FREE, _) => !point_contact_holds,
                _ => true,
            };
            option && contacts.contains(from) && contacts.contains(to)
        };
        for &from in contacts
            .iter()
            .filter(|(support, _)| *support != SoleContact::Heel)
        {
            let guards = Guards::of_ends(&model, from);
            let expected: Vec<usize> = (0..TRANSITIONS.len())
                .filter(|&i| TRANSITIONS[i].1 == from && is_allowed(&TRANSITIONS[i]))
                .collect();
            assert_eq!(
                guards.as_slice().len(),
                expected.len(),
                "{from:?}, {options:05b}"
            );
            for i in expected {
                let (guard, _, to, swap) = TRANSITIONS[i];
                assert!(
                    guards.as_slice().contains(&guard),
                    "{from:?}, {options:05b}"
                );
                let edge = EDGES
                    .iter()
                    .find(|e| e.guard == guard && e.starts_from(from))
                    .expect("a rule");
                assert_eq!((edge.target(from), edge.swap), (to, swap));
                if matches!(guard, Guard::Gap(..)) {
                    assert_eq!(guard.landed(from), to);
                }
                followed[i] = true;
            }
        }
    }
    assert_eq!(followed, [true; TRANSITIONS.len()]);
}
