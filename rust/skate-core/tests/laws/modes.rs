//! Table 2 and Fig. 3.

use skate_core::{
    contact::equations::unknowns,
    events::EDGES,
    model::contact_mode::{ContactMode, Foot, FrictionMode, SoleContact, TABLE_2},
};

/// Every row of Table 2 corresponds to exactly one pair of foot contacts and to its number, and its
/// unknowns are those of the row.
#[test]
fn table_2_enumerates_the_contact_modes() {
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
                    let multipliers = [row.f_nz, row.tau_n, row.f_ny];
                    let unknown = [
                        [row.y0, row.q1].map(usize::from).iter().sum::<usize>(),
                        multipliers.map(usize::from).iter().sum(),
                    ];
                    assert_eq!(unknowns(mode), unknown.into(), "state {number}");
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
