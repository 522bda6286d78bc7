//! One robot, one episode after another.

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

/// First bytes of a saved episode; the digit counts incompatible changes of `Saved`.
const MAGIC: &[u8] = b"IceSkateEpisode3";

/// Where an episode stands.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
pub enum Stage {
    /// Never reset.
    New,
    Running,
    Over,
}

/// See the module's documentation.
#[derive(Debug, Clone)]
pub struct Episode {
    pub sim: Simulation,
    /// Of all starts since the seed.
    pub(super) rng: ChaCha8Rng,
    /// Where somebody pushes.
    kicks: Option<Kicks>,
    /// A seed has been given.
    seeded: bool,
    /// Actions since the start.
    elapsed: u64,
    stage: Stage,
    /// Height of the head when standing upright [m].
    pub(super) standing: f64,
}

/// What people may want to know besides the observation.
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
    /// Where the hips are, forward [m].
    pub y_position: f64,
    pub end: Option<Termination>,
    /// Of the last action, by `TERMS`; zero after a reset.
    pub terms: [f64; TERMS.len()],
}

/// What an action, or a reset, came to.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Row {
    pub reward: f64,
    pub terminated: bool,
    pub truncated: bool,
    pub info: Info,
}

/// Where an action began.
#[derive(Debug, Clone, Copy)]
pub struct Begun {
    /// [s]
    t: f64,
    totals: Totals,
    /// Mean square of the action.
    effort: f64,
}

/// What an episode was before its simulation began anew.
#[derive(Debug)]
pub(crate) struct Rollback {
    sim: sim::Rollback,
    rng: ChaCha8Rng,
    kicks: Option<Kicks>,
    seeded: bool,
}

/// What `Episode` cannot compute again.
#[derive(Serialize, Deserialize)]
struct Saved {
    sim: snapshot::Saved,
    rng: ChaCha8Rng,
    kicks: Option<Kicks>,
    seeded: bool,
    elapsed: u64,
    stage: Stage,
}

impl Episode {
    /// One that waits for its first reset.
    ///
    /// # Errors
    /// `Invalid` where the scene's start is not one, or the task disturbs it as it cannot be.
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
            stage: Stage::New,
        })
    }

    /// Ask for what an action begins with: where episodes are many it is far away in memory.
    pub(crate) fn prefetch(&self) {
        prefetch(&self.stage);
        self.sim.prefetch();
    }

    pub fn stage(&self) -> Stage {
        self.stage
    }

    /// Has it been given a seed?
    pub fn is_seeded(&self) -> bool {
        self.seeded
    }

    /// Begin an episode.
    ///
    /// # Errors
    /// `Invalid`, and nothing has changed, where there is no such start.
    pub fn reset(&mut self, task: &Task, start: &Start) -> Result<(), Invalid> {
        let past = self.begin(task, start)?;
        self.settle(&past, start);
        Ok(())
    }

    /// The first half of a reset: `settle` or `roll_back` follows.
    ///
    /// # Errors
    /// As `reset`; nothing follows.
    pub(crate) fn begin(&mut self, task: &Task, start: &Start) -> Result<Rollback, Invalid> {
        let past = Rollback {
            sim: self.sim.save_for_rollback(),
            rng: self.rng.clone(),
            kicks: self.kicks.clone(),
            seeded: self.seeded,
        };
        if let Some(seed) = start.seed {
            self.rng = ChaCha8Rng::seed_from_u64(seed);
            self.seeded = true;
        }
        match start::begin(task, start, self) {
            Ok(()) => {
                let period = task.action_period();
                self.kicks = (task.kick > 0.0).then(|| Kicks::begin(period, &mut self.rng));
                Ok(past)
            }
            Err(why) => {
                self.roll_back(past);
                Err(why)
            }
        }
    }

    /// Stay at the beginning.
    pub(crate) fn settle(&mut self, past: &Rollback, start: &Start) {
        self.sim.forget();
        if !self.sim.is_like(&past.sim) {
            self.standing = standing_height(&self.sim.model);
        }
        self.elapsed = start.elapsed;
        self.stage = Stage::Running;
    }

    /// As if it had not begun.
    pub(crate) fn roll_back(&mut self, past: Rollback) {
        self.sim.roll_back(past.sim);
        (self.rng, self.kicks, self.seeded) = (past.rng, past.kicks, past.seeded);
    }

    /// Hold an action (one number per joint, those beyond -1 and 1 count as -1 and 1) over a period.
    pub fn step(&mut self, task: &Task, action: &[f64]) -> Row {
        let begun = self.begin_action(task, action);
        self.sim.advance(self.sim.next_action_time());
        self.end_action(task, &begun)
    }

    /// Kick the robot if it is time, and hold an action; whoever asks then advances the simulation by a period.
    pub fn begin_action(&mut self, task: &Task, action: &[f64]) -> Begun {
        if task.kick > 0.0
            && let Some(kicks) = &mut self.kicks
            && let Some(sign) = kicks.due(task.action_period())
        {
            let kicked = self.sim.kick(sign * task.kick);
            kicked.expect("checked with the task");
        }
        let (residual, effort) = residual(task, &self.sim, action);
        let begun = Begun {
            t: self.sim.state.t,
            totals: *self.sim.totals(),
            effort,
        };
        self.sim.hold(&residual[..task.joints()]);
        begun
    }

    /// What the action came to, a period later.
    pub fn end_action(&mut self, task: &Task, begun: &Begun) -> Row {
        self.elapsed += 1;
        let terms = reward::terms(task, self, (begun.t, begun.totals), begun.effort);
        let terminated = self.sim.ended.is_some();
        let truncated = task.limit.is_some_and(|limit| self.elapsed >= limit);
        if terminated || truncated {
            self.stage = Stage::Over;
        }
        Row {
            reward: terms.iter().sum(),
            terminated,
            truncated,
            info: Info {
                terms,
                ..self.info()
            },
        }
    }

    /// The present state as a reset leaves it.
    pub fn row(&self) -> Row {
        Row {
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

    /// Write the observation, as many numbers as the task's `observation` has entries.
    pub fn observe(&self, task: &Task, out: &mut [f32]) {
        observe(&self.sim, self.standing, &task.bounds, out);
    }

    /// Everything needed to continue, random numbers included.
    pub fn snapshot(&self) -> Vec<u8> {
        let saved = Saved {
            sim: self.sim.saved(),
            rng: self.rng.clone(),
            kicks: self.kicks.clone(),
            seeded: self.seeded,
            elapsed: self.elapsed,
            stage: self.stage,
        };
        seal(MAGIC, &saved)
    }

    /// Go back to a snapshot of an episode on the same scene.
    ///
    /// # Errors
    /// `Invalid`, and nothing has changed, where the bytes are damaged or of another kind.
    pub fn restore(&mut self, bytes: &[u8]) -> Result<(), Invalid> {
        let saved: Saved = open(MAGIC, bytes)
            .map_err(|why| Invalid(format!("not a snapshot of this environment: {why}")))?;
        let before = Arc::clone(&self.sim.model);
        self.sim.restore_saved(&saved.sim)?;
        if !Arc::ptr_eq(&before, &self.sim.model) {
            self.standing = standing_height(&self.sim.model);
        }
        (self.rng, self.kicks) = (saved.rng, saved.kicks);
        (self.seeded, self.elapsed, self.stage) = (saved.seeded, saved.elapsed, saved.stage);
        Ok(())
    }
}
