//! Derivatives of an action: state, observation and reward after it, by the state before it and by the action.

use crate::{
    derivatives::{Linearization, Nonsmooth, observed, state_size},
    error::Invalid,
    model::scheme::Scheme,
    numeric::{dual::Dual, scalar::Scalar},
    sim::Simulation,
    task::{
        ActionResult, ActionStart, Episode, Task,
        action::{self, ActionSlope},
        observe_derivatives,
        reward::{self, Moment, Progress, head_height_at},
    },
};
use nalgebra::{DMatrix, DVector, RowDVector};

/// What a task remembers of a motion, in the order of the entries that follow the differentiated state: time of the
/// last change of contact [s]; position of the hips at the start of the gait step, and loaded slide since then [m].
pub const MEMORY: usize = 3;
const CHANGED: usize = 0;
const HIPS: usize = 1;
const SLID: usize = 2;

/// Derivatives of an action. The state is that of `Simulation::state_vector`, followed by `MEMORY` entries.
#[derive(Debug, Clone)]
pub struct ActionDerivatives {
    /// State after the action by the state before it, and by the action.
    pub A: DMatrix<f64>,
    pub B: DMatrix<f64>,
    /// Reward by the state before the action, and by the action.
    pub reward: [DVector<f64>; 2],
    /// Observation after the action by the state after it.
    pub observation: DMatrix<f64>,
    /// Reasons for which the derivatives may not exist.
    pub nonsmooth: Vec<Nonsmooth>,
}

impl Task {
    /// Check that actions have derivatives.
    ///
    /// # Errors
    /// `Invalid` for an accuracy without derivatives, a limit of the torques, and kicks.
    pub fn check_derivatives(&self) -> Result<(), Invalid> {
        let methods = Scheme::from(self.scene().accuracy).methods();
        let refused = if self.torque_limit.is_finite() {
            "torque_limit: must be infinite"
        } else if self.kick > 0.0 {
            "kick: must be 0"
        } else if methods.usual.is_implicit() {
            "accuracy: must have the method dop853, dopri5, rk4 or moreau"
        } else {
            return Ok(());
        };
        Err(Invalid(format!("{refused} for derivatives")))
    }
}

impl Episode {
    /// The state of `ActionDerivatives`.
    pub fn state_vector(&self) -> Vec<f64> {
        let (sim, progress) = (&self.sim, &self.progress);
        let slid = sim.totals().loaded_slide - progress.slide;
        let mut state = sim.state_vector();
        state.extend([sim.state.t - sim.since_event(), progress.hips, slid]);
        state
    }

    /// `step` with derivatives; None where the action terminates the episode, or where the motion is stiff.
    ///
    /// # Errors
    /// As `Task::check_derivatives`; nothing has changed.
    pub fn step_differentiated(
        &mut self,
        task: &Task,
        action: &[f64],
    ) -> Result<(ActionResult, Option<ActionDerivatives>), Invalid> {
        task.check_derivatives()?;
        let leg = self.sim.state.support_leg;
        let (start, residual) = self.choose(task, action);
        let before = Before {
            hips: hips_gradient(&self.sim),
            progress: self.progress,
            start,
        };
        let (until, joints) = (self.sim.next_action_time(), task.scale.len());
        // An error is a termination, which the simulation holds, or a stiff motion.
        let motion = self
            .sim
            .linearize(&residual[..joints], until, &[], &|| true)
            .ok()
            .flatten();
        let result = self.end_action(task, &start);
        let slopes = action::slopes(task, leg, action);
        // A robot that has made no step for too long has a motion, but its reward has a jump.
        let derivatives = motion
            .filter(|_| !result.terminated)
            .map(|motion| self.differentiate(task, &before, motion, &slopes));
        Ok((result, derivatives))
    }

    fn differentiate(
        &self,
        task: &Task,
        before: &Before,
        motion: Linearization,
        slopes: &[ActionSlope],
    ) -> ActionDerivatives {
        let (sim, size) = (&self.sim, state_size(self.sim.model.n));
        let (all, joints) = (size + MEMORY, task.joints());
        // Columns of state and memory before the action, then of the action.
        let mut state = DMatrix::zeros(all, all + joints);
        let mut totals = DMatrix::zeros(3, all + joints);
        state.view_mut((0, 0), (size, size)).copy_from(&motion.A);
        totals
            .view_mut((0, 0), (3, size))
            .copy_from(&motion.totals.columns(0, size));
        for (column, slope) in slopes.iter().enumerate() {
            let to = all + column;
            let by_torque = motion.B.column(slope.joint) * slope.torque;
            state.view_mut((0, to), (size, 1)).copy_from(&by_torque);
            let by_torque = motion.totals.column(size + slope.joint) * slope.torque;
            totals.set_column(to, &by_torque);
        }
        match motion.changed {
            true => state.set_row(size + CHANGED, &totals.row(2)),
            false => state[(size + CHANGED, size + CHANGED)] = 1.0,
        }
        let seen = Seen::of(sim, task, self.standing);
        let chain = |by_state: &RowDVector<f64>| by_state * state.rows(0, size);
        let [hips, head] = [&seen.hips, &seen.head.1].map(chain);
        let (start, now) = (&before.start.0, Moment::of(sim));
        let mut reward = RowDVector::zeros(all + joints);
        for column in 0..all + joints {
            let along = |x: f64, d: f64| Dual { x, d };
            let kept = |entry: usize| f64::from(u8::from(column == size + entry));
            let start = Moment {
                t: start.t,
                hips: along(start.hips, before.hips.get(column).map_or(0.0, |d| *d)),
                loaded_slide: Dual::of(start.loaded_slide),
                flight: Dual::of(start.flight),
                swaps: start.swaps,
            };
            let now = Moment {
                t: now.t,
                hips: along(now.hips, hips[column]),
                loaded_slide: along(now.loaded_slide, totals[(0, column)]),
                flight: along(now.flight, totals[(1, column)]),
                swaps: now.swaps,
            };
            let progress = Progress {
                hips: along(before.progress.hips, kept(HIPS)),
                slide: along(before.progress.slide, -kept(SLID)),
            };
            let head = along(seen.head.0, head[column]);
            let moments = (&start, &now);
            let (terms, after) = reward::terms(&task.weights, progress, moments, head, false);
            reward[column] = terms.iter().map(|term| term.d).sum();
            state[(size + HIPS, column)] = after.hips.d;
            state[(size + SLID, column)] = (now.loaded_slide - after.slide).d;
        }
        let mut observation = DMatrix::zeros(task.observation.len(), all);
        observation
            .columns_mut(0, size + 1)
            .copy_from(&seen.observation);
        if let Some(mirror) = task.mirror_for(sim.state.support_leg) {
            mirror.rows(&mut observation);
        }
        ActionDerivatives {
            A: state.columns(0, all).into_owned(),
            B: state.columns(all, joints).into_owned(),
            reward: [(0, all), (all, joints)]
                .map(|(from, len)| reward.columns(from, len).transpose()),
            observation,
            nonsmooth: motion.nonsmooth,
        }
    }
}

/// What the derivative needs of the state before the action.
struct Before {
    hips: RowDVector<f64>,
    progress: Progress,
    start: ActionStart,
}

/// Derivative of the position of the hips by the differentiated state.
fn hips_gradient(sim: &Simulation) -> RowDVector<f64> {
    let mut row = RowDVector::zeros(state_size(sim.model.n));
    observed(sim, |i, seen| row[i] = seen.hips().d);
    row
}

/// What the reward and the learner read after an action, by the differentiated state.
struct Seen {
    hips: RowDVector<f64>,
    /// Normalised height.
    head: (f64, RowDVector<f64>),
    /// Also by the time of the last change of contact.
    observation: DMatrix<f64>,
}

impl Seen {
    fn of(sim: &Simulation, task: &Task, standing: f64) -> Self {
        let zero = RowDVector::zeros(state_size(sim.model.n));
        let (mut hips, mut head) = (zero.clone(), (0.0, zero));
        let observation = observe_derivatives::gradient((sim, task), standing, |i, seen| {
            hips[i] = seen.hips().d;
            let height = seen.q[1] + seen.sole_points.head[2];
            let height = head_height_at(&sim.model, height, standing);
            (head.0, head.1[i]) = (height.x, height.d);
        });
        Self {
            hips,
            head,
            observation,
        }
    }
}
