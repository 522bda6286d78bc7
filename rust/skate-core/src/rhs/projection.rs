//! Back onto the constraints of the free foot: mass-weighted, positions then velocities, no
//! Baumgarte (Eich 1993). The supporting foot needs none: its fixed coordinates are not integrated.

use crate::{
    contact::equations::{PHI, Slip, Y},
    error::Termination,
    model::{
        Model,
        contact_mode::{ContactMode, SoleContact},
        layout::{FREE_FOOT, NV},
        state::State,
    },
    rhs::Evaluation,
};
use nalgebra::Vector3;

/// Violations that are left alone [m, rad], [m/s, rad/s].
const POSITION: f64 = 1e-12;
const VELOCITY: f64 = 1e-11;

/// Violation of the free foot's constraints: of positions and of velocities (y, z, rotation). `eval`
/// knows where its contact point is.
pub fn violation(eval: &Evaluation, state: &State) -> (Vector3<f64>, Vector3<f64>) {
    let free = state.mode.free;
    let flat = if free.touch == SoleContact::Flat {
        1.0
    } else {
        0.0
    };
    let sticks = if free.slides() { 0.0 } else { 1.0 };
    let angle = eval.kin.angle[FREE_FOOT];
    let turn = std::f64::consts::TAU;
    let angle = angle - turn * (angle / turn).round();
    let gap = Vector3::new(
        sticks * (state.q[0] + eval.point.y - state.anchor),
        state.q[1] + eval.point.z,
        flat * angle,
    );
    let mut speed = Vector3::from(eval.point_velocity);
    speed[Y] *= sticks;
    speed[PHI] *= flat;
    (gap, speed)
}

/// Most corrections of the positions; one takes a violation e to about e^2, or e times the first.
pub const MOST: usize = 8;

/// Project the state; returns whether anything had to move. `eval` is assembled for the state and,
/// if it moved, must be evaluated anew. All corrections use the one factor of M at hand.
pub fn project(
    model: &Model,
    eval: &mut Evaluation,
    state: &mut State,
) -> Result<bool, Termination> {
    if state.mode.free.touch == SoleContact::Air {
        return Ok(false);
    }
    let mut moved = project_positions(model, eval, state)?;
    let (_, speed) = violation(eval, state);
    if speed.amax() > VELOCITY {
        moved = true;
        let step = correction(model, eval, state.mode, &speed)?;
        for c in 0..model.n {
            state.v[c] += step[c];
        }
    }
    Ok(moved)
}

/// Is the free foot where its constraints want it? `eval` knows where its contact point is.
pub fn is_on_ice(eval: &Evaluation, state: &State) -> bool {
    violation(eval, state).0.amax() <= POSITION
}

/// The positions alone, as at the instant of an impact; the free foot is on the ice.
pub fn project_positions(
    model: &Model,
    eval: &mut Evaluation,
    state: &mut State,
) -> Result<bool, Termination> {
    let mode = state.mode;
    let mut moved = false;
    let (mut gap, _) = violation(eval, state);
    for _ in 0..MOST {
        if gap.amax() <= POSITION {
            break;
        }
        moved = true;
        let step = correction(model, eval, mode, &gap)?;
        for c in 0..model.n {
            state.q[c] += step[c];
        }
        eval.move_legs(model, mode, &state.q, &state.v);
        (gap, _) = violation(eval, state);
    }
    Ok(moved)
}

/// Least change, in the metric of M, that takes the violation away.
fn correction(
    model: &Model,
    eval: &mut Evaluation,
    mode: ContactMode,
    violation: &Vector3<f64>,
) -> Result<[f64; NV], Termination> {
    let mut problem = eval.factored.problem;
    problem.b = Vector3::zeros();
    problem.alpha0 = *violation;
    let solution = problem.solve(mode, Slip::default())?;
    Ok(*eval.response(model, &solution.a_root, &solution.lam))
}
