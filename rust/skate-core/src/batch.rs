//! Vector of episodes, advanced in parallel. The results of one episode depend neither on the others nor on
//! the number of threads.

use crate::{
    error::Invalid,
    numeric::{prefetch::prefetch, simd::Width},
    sim::{HasSimulation, Simulation, advance_many},
    task::{ActionResult, ActionStart, Episode, EpisodeStatus, RollbackState, Start, Task},
};
use rayon::{ThreadPool, ThreadPoolBuilder, prelude::*};
use std::{
    cell::Cell,
    iter, process,
    sync::{Arc, Mutex, PoisonError},
    thread,
};

/// Number of chunks of episodes per thread and step, which balances the load, and the maximum number of episodes in a
/// chunk.
const CHUNKS_PER_THREAD: usize = 16;
const MAX_CHUNK: usize = 16;

/// Autoreset modes, as named by Gymnasium.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Autoreset {
    /// The next step resets the episode and ignores its action.
    NextStep,
    /// The same step resets the episode; its final result is returned as well.
    SameStep,
    /// The caller has to reset.
    Disabled,
}

/// See the module's documentation.
pub struct Batch {
    pub task: Task,
    pub episodes: Vec<Episode>,
    autoreset: Autoreset,
    threads: usize,
    /// All episodes can step: the last call was a step with an autoreset mode.
    ready: bool,
    /// SIMD width for fixed time steps.
    pub lanes: Width,
}

/// Final result of an episode that has been reset in the same step.
#[derive(Debug, Clone)]
pub struct FinalResult {
    pub result: ActionResult,
    pub observation: Vec<f32>,
}

/// Result of a step for one episode, with the final result of the previous episode after a same-step reset.
pub type Outcome = (ActionResult, Option<Box<FinalResult>>);

impl Batch {
    /// `n` episodes that have not been reset, advanced by up to `threads` threads (None: all cores).
    ///
    /// # Errors
    /// `Invalid` if the scene's start is invalid or a count is 0.
    pub fn new(
        task: Task,
        n: usize,
        autoreset: Autoreset,
        threads: Option<usize>,
    ) -> Result<Self, Invalid> {
        let threads = threads.unwrap_or_else(cores);
        if n == 0 || threads == 0 {
            let message = format!("{n} environments, {threads} threads: must be at least 1");
            return Err(Invalid(message));
        }
        Ok(Self {
            episodes: vec![Episode::new(&task)?; n],
            task,
            autoreset,
            threads,
            ready: false,
            lanes: Width::widest(),
        })
    }

    /// Reset episodes. If an index occurs more than once, its last start counts.
    ///
    /// # Errors
    /// `Invalid` if a start is invalid; no episode has changed.
    pub fn reset(&mut self, starts: &[(usize, Start)]) -> Result<(), Invalid> {
        let task = &self.task;
        let mut wanted = vec![None; self.episodes.len()];
        for (i, start) in starts {
            wanted[*i] = Some(start);
        }
        let pairs = self.episodes.iter_mut().zip(wanted);
        let mut resets: Vec<Reset> = pairs
            .filter_map(|(episode, start)| Some((episode, start?, None)))
            .collect();
        let begin = |(episode, start, saved): &mut Reset| {
            *saved = Some(episode.begin_reset(task, start)?);
            Ok(())
        };
        let begun = if self.threads == 1 || resets.len() == 1 {
            resets.iter_mut().try_for_each(begin)
        } else {
            let per_thread = resets.len().div_ceil(self.threads).max(1);
            let shares = resets.par_iter_mut().with_min_len(per_thread);
            pool().install(|| shares.try_for_each(begin))
        };
        for (episode, start, saved) in resets {
            match saved {
                Some(saved) if begun.is_ok() => episode.commit_reset(&saved, start),
                Some(saved) => episode.roll_back(saved),
                None => {}
            }
        }
        begun
    }

    /// The first episode that cannot step, and its status.
    pub fn waiting(&self) -> Option<(usize, EpisodeStatus)> {
        // The scan is slow for many episodes.
        if self.ready {
            return None;
        }
        let mut statuses = self.episodes.iter().map(Episode::status).enumerate();
        statuses.find(|&(_, status)| match status {
            EpisodeStatus::New => true,
            EpisodeStatus::Over => self.autoreset == Autoreset::Disabled,
            EpisodeStatus::Running => false,
        })
    }

    /// Step every episode. `actions` must be finite; `observations` and `outcomes` must have room for all
    /// episodes.
    ///
    /// # Errors
    /// `Invalid` if the reset of an episode finds no valid start; the other episodes have advanced.
    pub fn step(
        &mut self,
        actions: &[f64],
        observations: &mut [f32],
        outcomes: &mut [Outcome],
    ) -> Result<(), Invalid> {
        let (joints, width) = (self.task.joints(), self.task.observation.len());
        let n = self.episodes.len();
        let threads = self.threads.min(n);
        let per_thread = n.div_ceil(threads);
        self.ready = false;
        let chunk = per_thread.div_ceil(CHUNKS_PER_THREAD).min(MAX_CHUNK);
        let chunks = self
            .episodes
            .chunks_mut(chunk)
            .zip(actions.chunks(chunk * joints))
            .zip(observations.chunks_mut(chunk * width))
            .zip(outcomes.chunks_mut(chunk));
        let chunks = Mutex::new(chunks);
        let next = || chunks.lock().unwrap_or_else(PoisonError::into_inner).next();
        let (task, rules) = (&self.task, (self.autoreset, self.lanes, per_thread));
        let done = Mutex::new(Ok(()));
        let work = || {
            let all =
                iter::from_fn(next).flat_map(|(((episodes, actions), observations), outcomes)| {
                    let results = observations.chunks_mut(width).zip(outcomes);
                    episodes.iter_mut().zip(actions.chunks(joints)).zip(results)
                });
            if let Err(invalid) = step_episodes(task, rules, all) {
                *done.lock().unwrap_or_else(PoisonError::into_inner) = Err(invalid);
            }
        };
        if threads == 1 {
            work();
        } else {
            // The calling thread works as well and does not wait for a pool thread to wake up.
            pool().in_place_scope(|scope| {
                (1..threads).for_each(|_| scope.spawn(|_| work()));
                work();
            });
        }
        done.into_inner().unwrap_or_else(PoisonError::into_inner)?;
        self.ready = self.autoreset != Autoreset::Disabled;
        Ok(())
    }

    /// Restore an episode from a snapshot.
    ///
    /// # Errors
    /// As `Episode::restore`; nothing has changed.
    pub fn restore(&mut self, i: usize, data: &[u8]) -> Result<(), Invalid> {
        self.episodes[i].restore(data)?;
        self.ready = false;
        Ok(())
    }
}

/// Episode to reset, its start, and its state before the reset.
type Reset<'a> = (&'a mut Episode, &'a Start, Option<RollbackState>);

/// Episode during a step, with the destinations of its observation and outcome.
struct PendingAction<'a> {
    episode: &'a mut Episode,
    begun: ActionStart,
    observation: &'a mut [f32],
    outcome: &'a mut Outcome,
}

impl HasSimulation for PendingAction<'_> {
    fn sim(&self) -> &Simulation {
        &self.episode.sim
    }

    fn sim_mut(&mut self) -> &mut Simulation {
        &mut self.episode.sim
    }
}

/// Step some episodes, and reset those that have ended according to the autoreset mode.
fn step_episodes<'a>(
    task: &Task,
    (autoreset, lanes, max_batch): (Autoreset, Width, usize),
    all: impl Iterator<
        Item = (
            (&'a mut Episode, &'a [f64]),
            (&'a mut [f32], &'a mut Outcome),
        ),
    >,
) -> Result<(), Invalid> {
    let done = Cell::new(Ok(()));
    let keep_error = |result: Result<(), Invalid>| {
        if result.is_err() {
            done.set(result);
        }
    };
    let mut all = all.peekable();
    let prefetched = iter::from_fn(|| {
        let present = all.next();
        if let Some(((next, action), (_, outcome))) = all.peek() {
            next.prefetch();
            prefetch(*action);
            prefetch::<Outcome>(outcome);
        }
        present
    });
    let pending = prefetched.filter_map(|((episode, action), (observation, outcome))| {
        if episode.status() == EpisodeStatus::Over {
            let begun = episode.reset(task, &Start::default());
            if begun.is_ok() {
                *outcome = (episode.result(), None);
            }
            keep_error(begun);
            episode.observe(task, observation);
            return None;
        }
        let begun = episode.begin_action(task, action);
        let until = episode.sim.next_action_time();
        let action = PendingAction {
            episode,
            begun,
            observation,
            outcome,
        };
        Some((action, until))
    });
    advance_many(
        pending,
        task.scene().accuracy,
        (lanes, max_batch),
        |action| {
            let PendingAction {
                episode,
                begun,
                observation,
                outcome,
            } = action;
            let result = episode.end_action(task, &begun);
            *outcome = (result, None);
            if autoreset == Autoreset::SameStep && episode.status() == EpisodeStatus::Over {
                keep_error(reset_same_step(task, episode, result).map(|reset| *outcome = reset));
            }
            episode.observe(task, observation);
        },
    );
    done.into_inner()
}

/// Reset an episode that has ended; its final result and observation are returned with the new ones.
fn reset_same_step(
    task: &Task,
    episode: &mut Episode,
    result: ActionResult,
) -> Result<Outcome, Invalid> {
    let mut observation = vec![0.0; task.observation.len()];
    episode.observe(task, &mut observation);
    episode.reset(task, &Start::default())?;
    let reset = ActionResult {
        info: episode.result().info,
        ..result
    };
    Ok((
        reset,
        Some(Box::new(FinalResult {
            result,
            observation,
        })),
    ))
}

/// Thread pool of this process, one thread per core. Threads do not survive a fork, so a child process
/// creates its own pool.
fn pool() -> Arc<ThreadPool> {
    static POOL: Mutex<Option<(u32, Arc<ThreadPool>)>> = Mutex::new(None);
    let mut held = POOL.lock().unwrap_or_else(PoisonError::into_inner);
    match &*held {
        Some((owner, pool)) if *owner == process::id() => pool.clone(),
        _ => {
            let pool = ThreadPoolBuilder::new().num_threads(cores()).build();
            let pool = Arc::new(pool.expect("a thread pool"));
            // The parent's threads do not exist in this process and cannot be joined.
            if let Some((_, inherited)) = held.replace((process::id(), pool.clone())) {
                std::mem::forget(inherited);
            }
            pool
        }
    }
}

/// Number of cores available to this process.
fn cores() -> usize {
    thread::available_parallelism().map_or(1, usize::from)
}
