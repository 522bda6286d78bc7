//! Derivatives of an action: state, observation and reward after it, by the state before it and by the action.

use crate::{
    derivatives::{Linearization, Nonsmooth, observed, state_size},
    error::Invalid,
    model::scheme::Scheme,
    numeric::{dual::Dual, scalar::Scalar},
    scene::Leg,
    sim::Simulation,
    task::{
        ActionResult, Episode, Task, action, observe_derivatives,
        reward::{self, Moment, Posture, Progress, head_height_at, turned},
    },
};
use nalgebra::{DMatrix, DVector, RowDVector};

/// What a task remembers of a motion, in the order of the entries that follow the differentiated state: time of the
/// last change of contact [s]; position of the hips at the start of the gait step, loaded slide since then, and
/// rewarded slide of the step before it [m].
pub const MEMORY: usize = 4;
const CHANGED: usize = 0;
const HIPS: usize = 1;
const SLID: usize = 2;
const LAST: usize = 3;

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
        let changed = sim.state.t - sim.since_event();
        state.extend([changed, progress.hips, slid, progress.last]);
        state
    }

    /// `step` with derivatives; None where the action ends the motion, or where the motion is stiff.
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
            moment: start.moment,
        };
        let (until, joints) = (self.sim.next_action_time(), task.scale.len());
        // An error is a termination, which the simulation holds, or a stiff motion.
        let motion = self
            .sim
            .linearize(&residual[..joints], until, &[], &|| true)
            .ok()
            .flatten();
        let result = self.end_action(task, &start);
        let derivatives = motion.map(|motion| {
            let choice = Choice::of(task, leg, action, start.effort);
            self.differentiate(task, &before, motion, choice)
        });
        Ok((result, derivatives))
    }

    fn differentiate(
        &self,
        task: &Task,
        before: &Before,
        motion: Linearization,
        choice: Choice,
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
        for (column, &(joint, torque)) in choice.torques.iter().enumerate() {
            let to = all + column;
            let by_torque = motion.B.column(joint) * torque;
            state.view_mut((0, to), (size, 1)).copy_from(&by_torque);
            let by_torque = motion.totals.column(size + joint) * torque;
            totals.set_column(to, &by_torque);
        }
        let memory = |entry: usize| {
            let mut row = RowDVector::zeros(all + joints);
            row[size + entry] = 1.0;
            row
        };
        let changed = match motion.changed {
            true => totals.row(2).into_owned(),
            false => memory(CHANGED),
        };
        state.set_row(size + CHANGED, &changed);
        let seen = Seen::of(sim, task, self.standing);
        let chain = |by_state: &RowDVector<f64>| by_state * state.rows(0, size);
        let mut hips_before = RowDVector::zeros(all + joints);
        hips_before.columns_mut(0, size).copy_from(&before.hips);
        let mut by_effort = RowDVector::zeros(all + joints);
        for (column, by) in choice.by_action.into_iter().enumerate() {
            by_effort[all + column] = by;
        }
        let (now, progress) = (Moment::of(sim), before.progress);
        let inputs = Inputs {
            values: [
                before.moment.hips,
                now.hips,
                now.loaded_slide,
                now.flight,
                seen.head.0,
                seen.trunk.0,
                choice.effort,
                progress.hips,
                progress.slide,
                progress.last,
            ],
            before: before.moment,
            now,
            progress,
        };
        let rows = [
            hips_before,
            chain(&seen.hips),
            totals.row(0).into_owned(),
            totals.row(1).into_owned(),
            chain(&seen.head.1),
            chain(&seen.trunk.1),
            by_effort,
            memory(HIPS),
            -memory(SLID),
            memory(LAST),
        ];
        let mut reward = RowDVector::zeros(all + joints);
        let mut after = [(); 3].map(|()| RowDVector::zeros(all + joints));
        for (i, row) in rows.iter().enumerate() {
            let (by, progress) = inputs.differentiate(task, i);
            reward += row * by;
            for (sum, by) in after.iter_mut().zip(progress) {
                *sum += row * by;
            }
        }
        for (entry, row) in [HIPS, SLID, LAST].into_iter().zip(after) {
            state.set_row(size + entry, &row);
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
    moment: Moment,
}

/// An action, differentiated by its entries.
struct Choice {
    /// Joint, and its residual torque per entry [N m].
    torques: Vec<(usize, f64)>,
    /// Mean square of the action.
    effort: f64,
    by_action: Vec<f64>,
}

impl Choice {
    fn of(task: &Task, leg: Leg, action: &[f64], effort: f64) -> Self {
        let slope = |a: f64| 2.0 * a / task.joints() as f64;
        let by_action = action.iter().map(|&a| match action::is_clipped(a) {
            true => 0.0,
            false => slope(a),
        });
        Self {
            torques: action::gradient(task, leg, action).collect(),
            effort,
            by_action: by_action.collect(),
        }
    }
}

/// The numbers that the reward depends on.
struct Inputs {
    values: [f64; 10],
    before: Moment,
    now: Moment,
    progress: Progress,
}

impl Inputs {
    /// Derivatives by number `i`: of the reward, and of hips, slide since then and last slide after the action.
    fn differentiate(&self, task: &Task, i: usize) -> (f64, [f64; 3]) {
        let mut x = self.values.map(Dual::<f64>::of);
        x[i].d = 1.0;
        let [
            hips_before,
            hips,
            loaded_slide,
            flight,
            head,
            trunk,
            effort,
            start,
            slide,
            last,
        ] = x;
        let before = Moment {
            t: self.before.t,
            hips: hips_before,
            loaded_slide: Dual::of(self.before.loaded_slide),
            flight: Dual::of(self.before.flight),
            swaps: self.before.swaps,
        };
        let now = Moment {
            t: self.now.t,
            hips,
            loaded_slide,
            flight,
            swaps: self.now.swaps,
        };
        let progress = Progress {
            t: self.progress.t,
            hips: start,
            slide,
            last,
        };
        let posture = Posture {
            head,
            trunk,
            effort,
            fallen: false,
        };
        let (terms, after) = reward::terms(&task.weights, progress, (&before, &now), &posture);
        let reward = terms.iter().map(|term| term.d).sum();
        let slid = loaded_slide - after.slide;
        (reward, [after.hips.d, slid.d, after.last.d])
    }
}

/// Derivative of the position of the hips by the differentiated state.
fn hips_gradient(sim: &Simulation) -> RowDVector<f64> {
    let mut row = RowDVector::zeros(state_size(sim.model.n));
    observed(&sim.model, &sim.state, |i, seen| row[i] = seen.hips().d);
    row
}

/// What the reward and the learner read after an action, by the differentiated state.
struct Seen {
    hips: RowDVector<f64>,
    /// See `Posture`.
    head: (f64, RowDVector<f64>),
    trunk: (f64, RowDVector<f64>),
    /// Also by the time of the last change of contact.
    observation: DMatrix<f64>,
}

impl Seen {
    fn of(sim: &Simulation, task: &Task, standing: f64) -> Self {
        let zero = RowDVector::zeros(state_size(sim.model.n));
        let (mut hips, mut head, mut trunk) = (zero.clone(), (0.0, zero.clone()), (0.0, zero));
        let observation = observe_derivatives::gradient((sim, task), standing, |i, seen| {
            hips[i] = seen.hips().d;
            let height = seen.q[1] + seen.sole_points.head[2];
            let height = head_height_at(&sim.model, height, standing);
            (head.0, head.1[i]) = (height.x, height.d);
            let turned = turned(task.trunk.iter().map(|&c| seen.q[c]));
            (trunk.0, trunk.1[i]) = (turned.x, turned.d);
        });
        Self {
            hips,
            head,
            trunk,
            observation,
        }
    }
}
