//! A sequence of episodes of one robot.

use crate::{
    error::{Invalid, Termination},
    model::layout::NV,
    numeric::prefetch::prefetch,
    scene::Leg,
    sim::{
        Simulation,
        snapshot::{self, open, seal},
    },
    task::{
        Start, TERMS, Task,
        action::residual,
        kicks::Kicks,
        observe::observe,
        reward::{self, Moment, Progress, head_height, standing_height},
        start,
    },
};
use rand::SeedableRng;
use rand_chacha::ChaCha8Rng;
use serde::{Deserialize, Serialize};
use std::sync::Arc;

/// First bytes of an episode snapshot; the digit counts incompatible changes of `EpisodeSnapshot`.
const MAGIC: &[u8] = b"IceSkateEpisode5";

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
    pub(super) random: Random,
    /// Actions since the start of the episode.
    elapsed: u64,
    status: EpisodeStatus,
    /// State of the reward.
    pub(super) progress: Progress,
    /// Height of the head when standing upright [m].
    pub(super) standing: f64,
}

/// Random numbers of a sequence of episodes.
#[derive(Debug, Clone, Serialize, Deserialize)]
pub(super) struct Random {
    /// Those of all starts since the seed.
    pub rng: ChaCha8Rng,
    /// Schedule of kicks, if the task has kicks.
    kicks: Option<Kicks>,
    /// A seed has been given.
    seeded: bool,
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
    /// See `Totals` [m].
    pub loaded_slide: f64,
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
pub struct ActionStart(pub(super) Moment);

/// The part of `Episode` that cannot be recomputed.
#[derive(Serialize, Deserialize)]
struct EpisodeSnapshot {
    sim: snapshot::Snapshot,
    random: Random,
    elapsed: u64,
    status: EpisodeStatus,
    progress: Progress,
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
            random: Random {
                rng: ChaCha8Rng::seed_from_u64(0),
                kicks: None,
                seeded: false,
            },
            elapsed: 0,
            status: EpisodeStatus::New,
            progress: Progress::default(),
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
        self.random.seeded
    }

    /// Start a new episode.
    ///
    /// # Errors
    /// `Invalid`, and nothing has changed, if the start is not valid.
    pub fn reset(&mut self, task: &Task, start: &Start) -> Result<(), Invalid> {
        let next = self.restarted(task, start, &|| true)?;
        self.replace(next);
        Ok(())
    }

    /// The episode after a reset; `replace` accepts it. `go_on` is called from time to time and returns false to
    /// interrupt the reset, and from then on.
    ///
    /// # Errors
    /// As `reset`, and if it has been interrupted.
    pub(crate) fn restarted(
        &mut self,
        task: &Task,
        start: &Start,
        go_on: &dyn Fn() -> bool,
    ) -> Result<Self, Invalid> {
        let mut next = Self {
            sim: self.sim.draft(),
            random: Random {
                kicks: None,
                ..self.random.clone()
            },
            status: EpisodeStatus::Running,
            elapsed: start.elapsed,
            ..*self
        };
        if let Some(seed) = start.seed {
            next.random.rng = ChaCha8Rng::seed_from_u64(seed);
            next.random.seeded = true;
        }
        start::reset(task, start, &mut next, go_on)?;
        if task.kick > 0.0 {
            let random = &mut next.random;
            random.kicks = Some(Kicks::new(task.action_period(), &mut random.rng));
        }
        if !Arc::ptr_eq(&next.sim.model, &self.sim.model) {
            next.standing = standing_height(&next.sim.model);
        }
        next.progress = Progress::at(&Moment::of(&next.sim));
        Ok(next)
    }

    /// Continue as `next`, which is this episode `restarted`.
    pub(crate) fn replace(&mut self, mut next: Self) {
        next.sim.adopt_logs(&mut self.sim);
        *self = next;
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
        let (start, residual) = self.choose(task, action);
        self.sim.hold(&residual[..task.scale.len()]);
        start
    }

    /// Apply a kick if one is due. Returns the residual torques of an action as well [N m].
    pub(super) fn choose(&mut self, task: &Task, action: &[f64]) -> (ActionStart, [f64; NV]) {
        let leg = self.sim.state.support_leg;
        if task.kick > 0.0
            && let Some(kicks) = &mut self.random.kicks
            && let Some(sign) = kicks.due(task.action_period())
        {
            let kicked = self.sim.kick(sign * task.kick);
            kicked.expect("a kick checked with the task");
        }
        let residual = residual(task, &self.sim, leg, action);
        (ActionStart(Moment::of(&self.sim)), residual)
    }

    /// End an action after its period.
    pub fn end_action(&mut self, task: &Task, start: &ActionStart) -> ActionResult {
        self.elapsed = self.elapsed.saturating_add(1);
        if self.sim.ended.is_none() && self.sim.since_step() > task.weights.longest_step {
            self.sim.ended = Some(Termination::NoStep);
        }
        let terminated = self.sim.ended.is_some();
        let head = head_height(&self.sim, self.standing);
        let moments = (&start.0, &Moment::of(&self.sim));
        let progress = self.progress;
        let (terms, progress) = reward::terms(&task.weights, progress, moments, head, terminated);
        self.progress = progress;
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
            loaded_slide: totals.loaded_slide,
            y_position: self.sim.state.q[0] + self.sim.sole_points.waist,
            end: self.sim.ended,
            terms: [0.0; TERMS.len()],
        }
    }

    /// Write the observation, one value per entry of the task's `observation`.
    pub fn observe(&self, task: &Task, out: &mut [f32]) {
        observe(&self.sim, self.standing, &task.bounds, out);
        if let Some(mirror) = task.mirror_for(self.sim.state.support_leg) {
            mirror.observation(out);
        }
    }

    /// Everything needed to continue, including the random number generators.
    pub fn snapshot(&self) -> Vec<u8> {
        let saved = EpisodeSnapshot {
            sim: self.sim.to_snapshot(),
            random: self.random.clone(),
            elapsed: self.elapsed,
            status: self.status,
            progress: self.progress,
        };
        seal(MAGIC, &saved)
    }

    /// Restore a snapshot of an episode on the same scene.
    ///
    /// # Errors
    /// `Invalid`, and nothing has changed, if the bytes are damaged or of another kind.
    pub fn restore(&mut self, bytes: &[u8]) -> Result<(), Invalid> {
        let damaged = |why: &str| Invalid(format!("not a snapshot of this environment: {why}"));
        let saved: EpisodeSnapshot = open(MAGIC, bytes).map_err(|why| damaged(&why))?;
        let Progress { hips, slide } = saved.progress;
        if ![hips, slide].into_iter().all(|x| saved.sim.allows(x)) {
            return Err(damaged("a number is out of range"));
        }
        let before = Arc::clone(&self.sim.model);
        self.sim.restore_snapshot(&saved.sim)?;
        if !Arc::ptr_eq(&before, &self.sim.model) {
            self.standing = standing_height(&self.sim.model);
        }
        (self.random, self.progress) = (saved.random, saved.progress);
        (self.elapsed, self.status) = (saved.elapsed, saved.status);
        Ok(())
    }
}
