//! Table 2 and Fig. 3.

use skate_core::{
    contact::equations::{PHI, Y, Z, held_components, live_components},
    events::EDGES,
    model::contact_mode::{ContactMode, Foot, FrictionMode, SoleContact, TABLE_2},
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

/// The paper's cycle 3 -> 7 -> 15 -> 16 -> 14 -> 3 can be walked along the edges.
#[test]
fn the_edges_hold_the_papers_cycle() {
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
