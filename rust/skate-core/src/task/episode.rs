//! A sequence of episodes of one robot.

use crate::{
    error::{Invalid, Termination},
    numeric::prefetch::prefetch,
    scene::Leg,
    sim::{
        self, Simulation,
        gait_statistics::Totals,
        snapshot::{self, open, seal},
    },
    task::{
        Start, TERMS, Task,
        action::residual,
        kicks::Kicks,
        observe::observe,
        reward::{self, standing_height},
        start,
    },
};
use rand::SeedableRng;
use rand_chacha::ChaCha8Rng;
use serde::{Deserialize, Serialize};
use std::sync::Arc;

/// First bytes of an episode snapshot; the digit counts incompatible changes of `EpisodeSnapshot`.
const MAGIC: &[u8] = b"IceSkateEpisode3";

/// Status of an episode.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
pub enum EpisodeStatus {
    /// Not reset yet.
    New,
    Running,
    Over,
}

/// Simulation of one robot with the state of its episode.
#[derive(Debug, Clone)]
pub struct Episode {
    pub sim: Simulation,
    /// Random numbers of all starts since the seed.
    pub(super) rng: ChaCha8Rng,
    /// Schedule of kicks, if the task has kicks.
    kicks: Option<Kicks>,
    /// A seed has been given.
    seeded: bool,
    /// Actions since the start of the episode.
    elapsed: u64,
    status: EpisodeStatus,
    /// Height of the head when standing upright [m].
    pub(super) standing: f64,
}

/// Diagnostics of an action, besides the observation.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Info {
    /// [s]
    pub time: f64,
    pub state_number: u8,
    pub leg: Leg,
    /// See `Totals`.
    pub steps: u64,
    pub flight_time: f64,
    pub double_support_time: f64,
    /// Position of the hips, forward [m].
    pub y_position: f64,
    pub end: Option<Termination>,
    /// Reward terms of the last action, in the order of `TERMS`; zero after a reset.
    pub terms: [f64; TERMS.len()],
}

/// Result of an action or a reset.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct ActionResult {
    pub reward: f64,
    pub terminated: bool,
    pub truncated: bool,
    pub info: Info,
}

/// Values at the start of an action.
#[derive(Debug, Clone, Copy)]
pub struct ActionStart {
    /// [s]
    t: f64,
    totals: Totals,
    /// Mean square of the action.
    effort: f64,
}

/// Rollback state of an episode for a tentative reset.
#[derive(Debug)]
pub(crate) struct RollbackState {
    sim: sim::RollbackState,
    rng: ChaCha8Rng,
    kicks: Option<Kicks>,
    seeded: bool,
}

/// The part of `Episode` that cannot be recomputed.
#[derive(Serialize, Deserialize)]
struct EpisodeSnapshot {
    sim: snapshot::Snapshot,
    rng: ChaCha8Rng,
    kicks: Option<Kicks>,
    seeded: bool,
    elapsed: u64,
    status: EpisodeStatus,
}

impl Episode {
    /// An episode that has not been reset.
    ///
    /// # Errors
    /// `Invalid` if the scene's start or the task's disturbances are not valid.
    pub fn new(task: &Task) -> Result<Self, Invalid> {
        task.check_disturbances()?;
        let sim = Simulation::new(Arc::clone(&task.model))?;
        Ok(Self {
            standing: standing_height(&sim.model),
            sim,
            rng: ChaCha8Rng::seed_from_u64(0),
            kicks: None,
            seeded: false,
            elapsed: 0,
            status: EpisodeStatus::New,
        })
    }

    /// Prefetch the data that an action reads first; a large batch does not fit in the cache.
    pub(crate) fn prefetch(&self) {
        prefetch(&self.status);
        self.sim.prefetch();
    }

    pub fn status(&self) -> EpisodeStatus {
        self.status
    }

    /// Whether a seed has been given.
    pub fn is_seeded(&self) -> bool {
        self.seeded
    }

    /// Start a new episode.
    ///
    /// # Errors
    /// `Invalid`, and nothing has changed, if the start is not valid.
    pub fn reset(&mut self, task: &Task, start: &Start) -> Result<(), Invalid> {
        let saved = self.begin_reset(task, start)?;
        self.commit_reset(&saved, start);
        Ok(())
    }

    /// Tentative reset; `commit_reset` or `roll_back` must follow.
    ///
    /// # Errors
    /// As `reset`; then neither may follow.
    pub(crate) fn begin_reset(
        &mut self,
        task: &Task,
        start: &Start,
    ) -> Result<RollbackState, Invalid> {
        let saved = RollbackState {
            sim: self.sim.begin_tentative_reset(),
            rng: self.rng.clone(),
            kicks: self.kicks.clone(),
            seeded: self.seeded,
        };
        if let Some(seed) = start.seed {
            self.rng = ChaCha8Rng::seed_from_u64(seed);
            self.seeded = true;
        }
        match start::reset(task, start, self) {
            Ok(()) => {
                let period = task.action_period();
                self.kicks = (task.kick > 0.0).then(|| Kicks::new(period, &mut self.rng));
                Ok(saved)
            }
            Err(error) => {
                self.roll_back(saved);
                Err(error)
            }
        }
    }

    /// Accept the tentative reset.
    pub(crate) fn commit_reset(&mut self, saved: &RollbackState, start: &Start) {
        self.sim.commit_reset();
        if !self.sim.shares_model(&saved.sim) {
            self.standing = standing_height(&self.sim.model);
        }
        self.elapsed = start.elapsed;
        self.status = EpisodeStatus::Running;
    }

    /// Undo the tentative reset.
    pub(crate) fn roll_back(&mut self, saved: RollbackState) {
        self.sim.roll_back(saved.sim);
        (self.rng, self.kicks, self.seeded) = (saved.rng, saved.kicks, saved.seeded);
    }

    /// Apply an action for one period. `action` has one entry per joint, clipped to [-1, 1].
    pub fn step(&mut self, task: &Task, action: &[f64]) -> ActionResult {
        let start = self.begin_action(task, action);
        self.sim.advance(self.sim.next_action_time());
        self.end_action(task, &start)
    }

    /// Start an action: apply a kick if one is due, and set the residual torques. The caller then advances
    /// the simulation by one period.
    pub fn begin_action(&mut self, task: &Task, action: &[f64]) -> ActionStart {
        if task.kick > 0.0
            && let Some(kicks) = &mut self.kicks
            && let Some(sign) = kicks.due(task.action_period())
        {
            let kicked = self.sim.kick(sign * task.kick);
            kicked.expect("a kick checked with the task");
        }
        let (residual, effort) = residual(task, &self.sim, action);
        let start = ActionStart {
            t: self.sim.state.t,
            totals: *self.sim.totals(),
            effort,
        };
        self.sim.hold(&residual[..task.joints()]);
        start
    }

    /// End an action after its period.
    pub fn end_action(&mut self, task: &Task, start: &ActionStart) -> ActionResult {
        self.elapsed += 1;
        let terms = reward::terms(task, self, (start.t, start.totals), start.effort);
        let terminated = self.sim.ended.is_some();
        let truncated = task.limit.is_some_and(|limit| self.elapsed >= limit);
        if terminated || truncated {
            self.status = EpisodeStatus::Over;
        }
        ActionResult {
            reward: terms.iter().sum(),
            terminated,
            truncated,
            info: Info {
                terms,
                ..self.info()
            },
        }
    }

    /// Result at the present state, as after a reset.
    pub fn result(&self) -> ActionResult {
        ActionResult {
            reward: 0.0,
            terminated: false,
            truncated: false,
            info: self.info(),
        }
    }

    fn info(&self) -> Info {
        let totals = self.sim.totals();
        Info {
            time: self.sim.state.t,
            state_number: self.sim.state.mode.number(),
            leg: self.sim.state.support_leg,
            steps: totals.swaps,
            flight_time: totals.flight,
            double_support_time: totals.double_support,
            y_position: self.sim.state.q[0] + self.sim.sole_points.waist,
            end: self.sim.ended,
            terms: [0.0; TERMS.len()],
        }
    }

    /// Write the observation, one value per entry of the task's `observation`.
    pub fn observe(&self, task: &Task, out: &mut [f32]) {
        observe(&self.sim, self.standing, &task.bounds, out);
    }

    /// Everything needed to continue, including the random number generators.
    pub fn snapshot(&self) -> Vec<u8> {
        let saved = EpisodeSnapshot {
            sim: self.sim.to_snapshot(),
            rng: self.rng.clone(),
            kicks: self.kicks.clone(),
            seeded: self.seeded,
            elapsed: self.elapsed,
            status: self.status,
        };
        seal(MAGIC, &saved)
    }

    /// Restore a snapshot of an episode on the same scene.
    ///
    /// # Errors
    /// `Invalid`, and nothing has changed, if the bytes are damaged or of another kind.
    pub fn restore(&mut self, bytes: &[u8]) -> Result<(), Invalid> {
        let saved: EpisodeSnapshot = open(MAGIC, bytes)
            .map_err(|error| Invalid(format!("not a snapshot of this environment: {error}")))?;
        let before = Arc::clone(&self.sim.model);
        self.sim.restore_snapshot(&saved.sim)?;
        if !Arc::ptr_eq(&before, &self.sim.model) {
            self.standing = standing_height(&self.sim.model);
        }
        (self.rng, self.kicks) = (saved.rng, saved.kicks);
        (self.seeded, self.elapsed, self.status) = (saved.seeded, saved.elapsed, saved.status);
        Ok(())
    }
}
