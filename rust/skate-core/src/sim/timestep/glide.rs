//! The motion over one step, whatever the contacts do in it.

use super::super::Simulation;
use crate::{
    contact::{
        ContactProblem, Mode, Solution, Touch, Y,
        select::{Question, Tolerance, consistent, select, slip},
    },
    control::lifting::{Feedback, feedback},
    error::EndCause,
    evaluate::Frozen,
    model::{Model, NV, ROOT},
    project::project_positions,
    state::{State, is_bounded},
    transition::touches,
};
use nalgebra::Vector3;

/// Solutions for the new velocities: the second knows their mean.
const PASSES: usize = 2;

/// Impulses and velocities that count as zero, as at an impact [N s], [m/s].
const TOLERANCE: Tolerance = Tolerance {
    force: 1e-9,
    motion: 1e-11,
};

/// What a step may do with contacts.
#[derive(Debug, Clone, Copy)]
pub(super) struct Freedom {
    /// The mode to stay as close to as possible.
    pub near: Mode,
    /// The start's mode has just been chosen for this step and stays.
    pub decided: bool,
}

impl Simulation {
    /// Move from `start` by `h` and return the mode that the impulses are consistent with. If it has
    /// other touches than the start's, nothing has moved.
    pub(super) fn glide(
        &mut self,
        start: &State,
        h: f64,
        freedom: Freedom,
    ) -> Result<Mode, EndCause> {
        let (model, eval) = (&self.model, &mut self.eval);
        let n = model.n.min(NV);
        let free = start.mode.free.touch;
        let mut q = start.q;
        for c in 0..n {
            q[c] += 0.5 * h * start.v[c];
        }
        let mut frozen = Frozen::of(model, start, &self.residual);
        frozen.now.t = start.t + 0.5 * h;
        eval.count += 1;
        eval.step_to(model, start.mode.support.touch, &q, &start.v);
        eval.assemble_with(model, free, 0.5 * h);
        let feedback = feedback(model, &eval.kin, &frozen.now);
        if let Some(Feedback { K, D, J }) = &feedback {
            let kappa = 0.5 * h * (D + 0.5 * h * K);
            eval.factored.stiffen(model, free, J, kappa)?;
        }
        let (mut v, mut mean) = (start.v, start.v);
        let (mut mode, mut solution) = (start.mode, Solution::default());
        for pass in 0..PASSES {
            if pass > 0 {
                for c in 0..n {
                    mean[c] = 0.5 * (start.v[c] + v[c]);
                }
                eval.kin.planar_velocities(model, &mean);
            }
            eval.apply_torques(model, &q, &mean, &frozen);
            if let Some(Feedback { D, J, .. }) = &feedback {
                // The torques know the last pass's velocities, the springs count from the start's.
                for (J, D) in J.iter().zip(D) {
                    let moved: f64 = (0..n).map(|c| J[c] * (v[c] - start.v[c])).sum();
                    for c in 0..n {
                        eval.tau[c] += J[c] * 0.5 * D * moved;
                    }
                }
            }
            eval.load_momentum(model, free, (&start.v, &mean), h);
            (mode, solution) = impulses(model, &eval.factored.problem, start.mode, freedom)?;
            if touches(mode) != touches(start.mode) {
                return Ok(mode);
            }
            let change = eval.change(model, free, &start.v, &solution);
            for c in 0..n {
                v[c] = start.v[c] + change[c];
            }
            v[..ROOT].copy_from_slice(solution.a_root.as_slice());
        }
        if !is_bounded(&v[..n]) {
            return Err(EndCause::NotFinite);
        }
        for c in 0..n {
            q[c] += 0.5 * h * v[c];
        }
        self.state = State {
            t: start.t + h,
            q,
            v,
            mode,
            ..*start
        };
        if self.model.scene.ledger {
            self.book(start, h, &solution);
        }
        self.eval.move_planar(&self.model, mode, &q, &v);
        if free != Touch::Air {
            if !mode.free.slides() && mode.free != start.mode.free {
                self.passage().set_anchor();
            }
            project_positions(&self.model, &mut self.eval, &mut self.state)?;
        }
        // For those who ask for forces: the means over the step.
        self.eval.solution = Solution {
            a_root: (solution.a_root - Vector3::new(start.v[0], start.v[1], start.v[2])) / h,
            f_root: solution.f_root / h,
            a_free: Vector3::zeros(),
            lam: solution.lam / h,
        };
        Ok(mode)
    }

    /// Energy of a step: forces act along the mean of old and new velocities.
    fn book(&mut self, start: &State, h: f64, solution: &Solution) {
        let eval = &self.eval;
        let state = &mut self.state;
        let mean = |c: usize| 0.5 * (start.v[c] + state.v[c]);
        let ledger = &mut state.ledger;
        let damped = |c: usize| h * self.model.damping[c] * mean(c) * mean(c);
        for c in 0..self.model.n.min(NV) {
            ledger.actuators += h * eval.tau[c] * mean(c);
            ledger.damping += damped(c);
        }
        // D holds the ice's viscous friction, too.
        ledger.damping -= damped(0);
        ledger.friction += damped(0) - solution.f_root[Y] * mean(0);
        let foot = 0.5 * (eval.point_velocity[Y] + solution.a_free[Y]);
        ledger.friction -= solution.lam[Y] * foot;
    }
}

/// Contact state over a step, its new velocities and impulses. Where none is consistent the feet go
/// on as they did.
fn impulses(
    model: &Model,
    problem: &ContactProblem,
    mode: Mode,
    freedom: Freedom,
) -> Result<(Mode, Solution), EndCause> {
    let stay = || Ok((mode, problem.solve(mode, slip(model, mode))?));
    if freedom.decided {
        return stay();
    }
    let question = Question {
        closed: [mode.support.touch, mode.free.touch],
        may_carry: [mode.support.touch, mode.free.touch],
        moving: [None, None],
        caught: None,
        slips: None,
        near: freedom.near,
        not: None,
        tolerance: TOLERANCE,
    };
    if let Some(solution) = consistent(model, problem, &question, mode)? {
        return Ok((mode, solution));
    }
    match select(model, problem, &question) {
        Err(EndCause::Jam) => stay(),
        found => found,
    }
}
