//! The laws of contact and friction at one state.

use crate::{
    contact::{
        equations::{PHI, Solution, Y, Z},
        loads::loads,
    },
    events::{guard::Guard, guards::Guards},
    laws::Law,
    model::{
        Model,
        contact_mode::{ContactMode, FREE, SUPPORT, SoleContact},
        friction::cone,
        layout::ROOT,
        state::State,
    },
    numeric::trig::nearest_half_turn,
    rhs::{
        Evaluation,
        projection::violation,
        sole_points::{SolePoints, fall_margin},
    },
};

/// Amounts by which contact forces break laws; those of the guard that has just fired are left out.
pub fn forces(
    model: &Model,
    mode: ContactMode,
    (lever, solution): ([f64; 2], &Solution),
    fired: Option<Guard>,
    mut report: impl FnMut(Law, f64),
) {
    let loads = loads(lever, mode, solution);
    let forces = [&solution.f_root, &solution.lam];
    let range = |which: usize| cone(model.friction.mu, forces[which][Z]);
    let guards = Guards::of(model, mode);
    for guard in guards
        .as_slice()
        .iter()
        .filter(|&&guard| Some(guard) != fired)
    {
        match *guard {
            Guard::Load(which, end) => report(Law::NormalForces, -loads[which][end as usize]),
            Guard::Pull(which) => {
                let sign = if mode.foot(which).pulled { 1.0 } else { -1.0 };
                report(Law::NormalForces, sign * forces[which][Z]);
            }
            Guard::ConeForward(which) => {
                report(Law::FrictionInCone, range(which)[0] - forces[which][Y]);
            }
            Guard::ConeBackward(which) => {
                report(Law::FrictionInCone, forces[which][Y] - range(which)[1]);
            }
            Guard::Gap(..) | Guard::Speed(_) | Guard::Reversal(_) | Guard::Wedge(_) => {}
            Guard::Fall => {}
        }
    }
}

/// Amounts by which positions and velocities break laws. `eval` has the kinematics of the state.
pub fn motion(
    model: &Model,
    eval: &Evaluation,
    state: &State,
    fired: Option<Guard>,
    mut report: impl FnMut(Law, f64),
) {
    let State { q, v, mode, .. } = state;
    let points = SolePoints::of_one(model, &eval.kin, *mode, q[1]);
    let guards = Guards::of(model, *mode);
    for guard in guards
        .as_slice()
        .iter()
        .filter(|&&guard| Some(guard) != fired)
    {
        match *guard {
            Guard::Gap(which, end) if !guard.counts_both_ways(model) => {
                report(Law::AboveIce, -points.gap(which, end));
            }
            // Time stepping ends a motion at the end of the step with the fall.
            Guard::Fall if model.scheme.locates_events() => {
                let head = eval.kin.head(model).z;
                report(Law::AboveIce, -fall_margin(model, &eval.kin, head, q[1]));
            }
            Guard::Reversal(which) => {
                let velocity = along(which, eval, state);
                report(
                    Law::SlidingDirection,
                    -mode.foot(which).friction_mode.sign() * velocity,
                );
            }
            _ => {}
        }
    }
    let support = mode.support;
    if support.touch != SoleContact::Air {
        let is_flat = support.touch == SoleContact::Flat;
        let held = [!support.slides(), true, is_flat];
        for c in (0..ROOT).filter(|&c| held[c]) {
            report(Law::ClosedEndsRest, v[c].abs());
            if c != Y {
                // A flat sole may lie upside down.
                let place = if c == PHI {
                    nearest_half_turn(q[c])
                } else {
                    0.0
                };
                report(Law::ClosedEndsStay, (q[c] - place).abs());
            }
        }
    }
    if mode.free.touch != SoleContact::Air {
        let (position, velocity) = violation(eval, state);
        report(Law::ClosedEndsStay, position.amax());
        report(Law::ClosedEndsRest, velocity.amax());
    }
}

/// Power that dry friction brings to the robot [W]. Not that of a pulled free foot where the scene lets friction act
/// on it as printed.
pub fn friction_power(model: &Model, eval: &Evaluation, state: &State) -> f64 {
    let forces = [&eval.solution.f_root, &eval.solution.lam];
    let brings = |which: usize| {
        let is_printed = model.contact.is_driven(which) && forces[which][Z] < 0.0;
        let slides = state.mode.foot(which).friction_mode.has_dry_friction();
        if slides && !is_printed {
            forces[which][Y] * along(which, eval, state)
        } else {
            0.0
        }
    };
    brings(SUPPORT).max(0.0) + brings(FREE).max(0.0)
}

/// Velocity of a foot along the ice [m/s].
fn along(which: usize, eval: &Evaluation, state: &State) -> f64 {
    match which {
        SUPPORT => state.v[0],
        _ => eval.point_velocity[Y],
    }
}
