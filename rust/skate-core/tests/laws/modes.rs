//! Table 2 and the table of transition rules.

use skate_core::{
    contact::equations::{PHI, Y, Z, held_components, live_components},
    events::{
        EDGES, Edge,
        guards::{Guard, Guards},
        landed,
    },
    model::Model,
    model::contact_mode::{ContactMode, FREE, Foot, FrictionMode, SoleContact, TABLE_2, touches},
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
                        unknowns(live_components(mode.support)),
                        [row.y0, false, row.q1],
                        "state {number}"
                    );
                    assert_eq!(
                        unknowns(held_components(mode.free)),
                        [row.f_ny, row.f_nz, row.tau_n],
                        "state {number}"
                    );
                }
            }
        }
    }
    assert!(seen[1..].iter().all(|&count| count == 1), "{seen:?}");
}

/// The paper's cycle 3 -> 7 -> 15 -> 16 -> 14 -> 3 is a path along the edges.
#[test]
fn the_edges_contain_the_cycle_of_the_paper() {
    use SoleContact::{Air, Flat, Heel, Toe};
    let leads = |from, to, swap| {
        EDGES
            .iter()
            .any(|e| (e.from, e.to, e.swap) == (from, to, swap))
    };
    assert!(leads((Flat, Air), (Flat, Heel), false));
    assert!(leads((Flat, Heel), (Flat, Flat), false));
    assert!(leads((Flat, Flat), (Toe, Flat), false));
    assert!(leads((Toe, Flat), (Flat, Air), true));
}

/// In every scene option of two-way contact the engine watches exactly the guards of the rules that the
/// options allow, and a landing leads where its rule says.
#[test]
fn the_engine_watches_the_guards_of_the_edges() {
    let mut followed = [false; EDGES.len()];
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
        let applies = |edge: &Edge| {
            let option = match edge.guard {
                Guard::Gap(..) => impacts,
                Guard::Load(FREE, _) => !point_contact_holds,
                _ => true,
            };
            option && contacts.contains(&edge.from) && contacts.contains(&edge.to)
        };
        for &from in contacts
            .iter()
            .filter(|(support, _)| *support != SoleContact::Heel)
        {
            let guards = Guards::of_ends(&model, from);
            let rules: Vec<usize> = (0..EDGES.len())
                .filter(|&i| EDGES[i].from == from && applies(&EDGES[i]))
                .collect();
            assert_eq!(
                guards.as_slice().len(),
                rules.len(),
                "{from:?}, {options:05b}"
            );
            for i in rules {
                let Edge { guard, to, .. } = EDGES[i];
                assert!(
                    guards.as_slice().contains(&guard),
                    "{from:?}, {options:05b}"
                );
                if matches!(guard, Guard::Gap(..)) {
                    assert_eq!(landed(from, guard), to);
                }
                followed[i] = true;
            }
        }
    }
    assert_eq!(followed, [true; EDGES.len()]);
}
