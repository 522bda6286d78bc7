//! Selection of the contact mode that is consistent with the laws of contact and friction.
//!
//! With at most four contact points the candidates are enumerated and their signs checked: Signorini's
//! conditions for every end of a sole (push-only contact), Coulomb's for every foot. The same conditions
//! serve accelerations with forces and, at an impact, velocities with impulses (Moreau 1988; Glocker 2001,
//! ch. 5); an inelastic impact that satisfies them cannot add energy. If several candidates are consistent,
//! the nearest to the reference mode is selected, and of several at the same distance the one whose forces change least,
//! whichever foot is the supporting one; if none is, the result is `Jam`.

use crate::{
    contact::{
        candidates::by_distance,
        conditions::{Condition, visit_conditions},
        equations::{ContactProblem, PHI, Slip, Solution, Y, Z},
        mode_query::ModeQuery,
    },
    error::Termination,
    model::{
        Model,
        contact_mode::{ContactMode, End, FREE, SUPPORT, SoleContact},
    },
};

/// The nearest consistent mode and its solution.
///
/// # Errors
/// `Jam` where no candidate is consistent; `Singular` where, besides, a candidate had no solution; `NotFinite`.
pub fn select(
    model: &Model,
    problem: &ContactProblem,
    query: &ModeQuery,
) -> Result<(ContactMode, Solution), Termination> {
    let mut singular = false;
    let mut nearest = None;
    let mut least = (u32::MAX, f64::INFINITY);
    for (distance, mode) in by_distance(model, query) {
        if distance > least.0 {
            break;
        }
        match consistent(model, problem, query, mode) {
            Ok(Some(solution)) => {
                let change = query.change_of_forces(&solution);
                if (distance, change) < least {
                    (least, nearest) = ((distance, change), Some((mode, solution)));
                }
            }
            Ok(None) => {}
            Err(Termination::Singular) => singular = true,
            Err(cause) => return Err(cause),
        }
    }
    nearest.ok_or(match singular {
        true => Termination::Singular,
        false => Termination::Jam,
    })
}

/// The mode's solution, if it satisfies every condition.
///
/// # Errors
/// `Singular` or `NotFinite` where the contact equations have no solution.
pub fn consistent(
    model: &Model,
    problem: &ContactProblem,
    query: &ModeQuery,
    mode: ContactMode,
) -> Result<Option<Solution>, Termination> {
    let lever = problem.lever;
    // The contact points of the mode may differ from those of the closed ends.
    let [closed_support, closed_free] = query.closed;
    let pivot_moves =
        closed_support == SoleContact::Flat && mode.support.touch == SoleContact::Heel;
    let point_moves = closed_free == SoleContact::Flat && mode.free.touch == SoleContact::Toe;
    let (mut support_end, mut free_end) = (closed_support.pivot(), closed_free.contact_point());
    let (with_pivot_moved, with_point_moved);
    let mut problem = problem;
    if pivot_moves {
        with_pivot_moved = problem.with_pivot_moved(-lever[SUPPORT]);
        (problem, support_end) = (&with_pivot_moved, End::Heel);
    }
    if point_moves {
        with_point_moved = problem.with_free_point_moved(lever[FREE]);
        (problem, free_end) = (&with_point_moved, End::Toe);
    }
    let solution = problem.solve(mode, Slip::of(model, mode))?;
    let tolerance = query.tolerance;
    let mut fails = false;
    let mut undecided = [None; 8];
    let mut n_undecided = 0;
    visit_conditions(
        model,
        (lever, &solution),
        mode,
        tolerance,
        |condition, holds, wrong| {
            match condition {
                // A foot that already slides keeps its direction.
                Condition::Direction(which) if query.sliding[which].is_some() => {}
                _ if wrong => fails = true,
                _ if !holds => {
                    undecided[n_undecided] = Some(condition);
                    n_undecided += 1;
                }
                _ => {}
            }
        },
    );
    if model.contact.is_push_only {
        for (which, (motion, at)) in [
            (&solution.a_root, support_end),
            (&solution.a_free, free_end),
        ]
        .into_iter()
        .enumerate()
        {
            // The heel is `length` behind the toe.
            let length = lever[which];
            let [heel, toe] = match at {
                End::Toe => [motion[Z] - length * motion[PHI], motion[Z]],
                End::Heel => [motion[Z], motion[Z] + length * motion[PHI]],
            };
            let closed = query.closed[which];
            let touch = mode.foot(which).touch;
            for (end, opening) in [(End::Heel, heel), (End::Toe, toe)] {
                // A closed end without load must open.
                if closed.has(end) && !touch.has(end) && opening < -tolerance.motion {
                    fails = true;
                }
            }
        }
    }
    if fails {
        return Ok(None);
    }
    for condition in undecided.into_iter().flatten() {
        let holds = match condition {
            Condition::Direction(which) => follows_push(problem, model, mode, which)?,
            Condition::NormalForce(which) => problem.load_gain(model, mode, which)? > 0.0,
            Condition::Load(_) | Condition::Cone(_) => false,
        };
        if !holds {
            return Ok(None);
        }
    }
    Ok(Some(solution))
}

/// Does a sliding foot that starts from rest follow a push along the ice? With high friction the normal force
/// that the push causes can reverse the answer (Painleve 1895; Genot and Brogliato 1999), and a foot at the
/// edge of its cone cannot slide.
fn follows_push(
    problem: &ContactProblem,
    model: &Model,
    mode: ContactMode,
    which: usize,
) -> Result<bool, Termination> {
    let problem = problem.with_unit_force(which, Y);
    let solution = problem.solve(mode, Slip::of(model, mode))?;
    let motion = if which == SUPPORT {
        solution.a_root
    } else {
        solution.a_free
    };
    Ok(motion[Y] > 0.0)
}
