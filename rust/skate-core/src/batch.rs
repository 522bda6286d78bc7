//! Vector of episodes, advanced in parallel. The results of one episode depend neither on the others nor on
//! the number of threads.

mod derivatives;
mod memory;
mod pool;

pub use pool::initialise_statics;

use crate::{
    error::Invalid,
    lanes::advance_many,
    model::scheme::Scheme,
    numeric::{prefetch::prefetch, simd::Width},
    sim::Simulation,
    task::{ActionResult, ActionStart, Episode, EpisodeStatus, Start, Task},
};
use pool::{cores, pool};
use std::{
    cell::Cell,
    iter,
    ops::{Deref, DerefMut},
    sync::{
        Mutex, PoisonError,
        atomic::{AtomicBool, Ordering},
    },
};

/// Number of chunks of episodes per thread and step, which balances the load, and the maximum number of episodes in a
/// chunk.
const CHUNKS_PER_THREAD: usize = 16;
const MAX_CHUNK: usize = 16;

/// Evaluations that a thread usually begins before it asks again whether to go on, some 0.03 s; at the least, those of
/// so many episodes.
const EVALUATIONS_AT_ONCE: f64 = 50_000.0;
const LEAST_AT_ONCE: f64 = 64.0;

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
    /// Maximum number of episodes that a thread advances before it asks again whether to go on.
    at_once: usize,
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
    /// `Invalid` if the scene's start is invalid, a count is 0, or the episodes do not fit into the memory.
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
        memory::check(&task, n)?;
        let usual = Scheme::from(task.scene().accuracy).usual_rate() * task.action_period();
        Ok(Self {
            at_once: (EVALUATIONS_AT_ONCE / usual).max(LEAST_AT_ONCE) as usize,
            episodes: vec![Episode::new(&task)?; n],
            task,
            autoreset,
            threads,
            ready: false,
            lanes: Width::widest(),
        })
    }

    /// Reset episodes, until `go_on` returns false. It is called on this thread and returns false from then on. If an
    /// index occurs more than once, its last start counts.
    ///
    /// # Errors
    /// `Invalid` if a start is invalid, or the reset has been interrupted; no episode has changed.
    pub fn reset(
        &mut self,
        starts: &[(usize, Start)],
        go_on: &dyn Fn() -> bool,
    ) -> Result<(), Invalid> {
        let task = &self.task;
        let mut wanted = vec![None; self.episodes.len()];
        for (i, start) in starts {
            wanted[*i] = Some(start);
        }
        let pairs = self.episodes.iter_mut().zip(wanted);
        let mut resets: Vec<Reset> = pairs
            .filter_map(|(episode, start)| {
                Some(Reset {
                    episode,
                    start: start?,
                    next: None,
                })
            })
            .collect();
        let n = resets.len();
        let threads = self.threads.min(n);
        let chunks = Mutex::new(resets.chunks_mut(chunk_size(n, self.threads)));
        let done = Mutex::new(Ok(()));
        let next = || {
            let so_far = lock(&done).is_ok();
            so_far.then(|| lock(&chunks).next()).flatten()
        };
        run_on(threads, go_on, |go_on| {
            let mut chunks = iter::from_fn(next).flatten();
            let result = chunks.try_for_each(|reset| {
                reset.next = Some(reset.episode.restarted(task, reset.start, go_on)?);
                Ok(())
            });
            if result.is_err() {
                *lock(&done) = result;
            }
        });
        done.into_inner().unwrap_or_else(PoisonError::into_inner)?;
        for Reset { episode, next, .. } in resets {
            episode.replace(next.expect("begun without an error"));
        }
        Ok(())
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

    /// Step every episode, until `go_on` returns false; then no other episode begins its action. `go_on` is called on
    /// this thread between episodes and returns false from then on. An episode has made the whole action or none.
    /// `actions` must be finite; `observations` and `outcomes` must have room for all episodes.
    ///
    /// # Errors
    /// `Invalid` if the reset of an episode finds no valid start; the other episodes have advanced.
    pub fn step(
        &mut self,
        actions: &[f64],
        observations: &mut [f32],
        outcomes: &mut [Outcome],
        go_on: &dyn Fn() -> bool,
    ) -> Result<(), Invalid> {
        self.ready = false;
        let n = self.episodes.len();
        let threads = self.threads.min(n);
        let (task, autoreset) = (&self.task, self.autoreset);
        let chunk = chunk_size(n, threads);
        let chunks = in_chunks(
            task,
            chunk,
            &mut self.episodes,
            actions,
            observations,
            outcomes,
        );
        if n == 1 {
            if let Some(step) = chunks.flatten().next().filter(|_| go_on()) {
                step.run(task, autoreset, |episode, action| {
                    Ok(episode.step(task, action))
                })?;
            }
        } else {
            let max_batch = n.div_ceil(threads).min(self.at_once);
            let lanes = (self.lanes, max_batch);
            let chunks = Mutex::new(chunks);
            let next = || lock(&chunks).next();
            let done = Mutex::new(Ok(()));
            run_on(threads, go_on, |go_on| {
                let all = iter::from_fn(next).flatten();
                let all = all.take_while(|_| go_on());
                let result = step_episodes(task, autoreset, lanes, all);
                if result.is_err() {
                    *lock(&done) = result;
                }
            });
            done.into_inner().unwrap_or_else(PoisonError::into_inner)?;
        }
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

/// Episode to reset, its start, and the episode that will replace it.
struct Reset<'a> {
    episode: &'a mut Episode,
    start: &'a Start,
    next: Option<Episode>,
}

/// Episode with its action, and the destinations of its observation and outcome.
struct EpisodeStep<'a> {
    episode: &'a mut Episode,
    action: &'a [f64],
    observation: &'a mut [f32],
    outcome: &'a mut Outcome,
}

impl EpisodeStep<'_> {
    /// Apply the action by `act`, or reset the episode if it is over.
    fn run(
        self,
        task: &Task,
        autoreset: Autoreset,
        act: impl FnOnce(&mut Episode, &[f64]) -> Result<ActionResult, Invalid>,
    ) -> Result<(), Invalid> {
        if self.episode.status() == EpisodeStatus::Over {
            return self.reset(task);
        }
        match act(self.episode, self.action) {
            Ok(result) => self.end(task, autoreset, result),
            Err(invalid) => {
                self.episode.observe(task, self.observation);
                Err(invalid)
            }
        }
    }

    /// Reset an episode that is over.
    fn reset(self, task: &Task) -> Result<(), Invalid> {
        let done = self.episode.reset(task, &Start::default());
        if done.is_ok() {
            *self.outcome = (self.episode.result(), None);
        }
        self.episode.observe(task, self.observation);
        done
    }

    /// Store the result of the action, and reset the episode if it is over and the autoreset mode says so.
    fn end(self, task: &Task, autoreset: Autoreset, result: ActionResult) -> Result<(), Invalid> {
        *self.outcome = (result, None);
        let mut done = Ok(());
        if autoreset == Autoreset::SameStep && self.episode.status() == EpisodeStatus::Over {
            done = reset_same_step(task, self.episode, result).map(|reset| *self.outcome = reset);
        }
        self.episode.observe(task, self.observation);
        done
    }
}

/// Step of an episode whose action has begun.
struct PendingAction<'a> {
    step: EpisodeStep<'a>,
    begun: ActionStart,
}

impl Deref for PendingAction<'_> {
    type Target = Simulation;

    fn deref(&self) -> &Simulation {
        &self.step.episode.sim
    }
}

impl DerefMut for PendingAction<'_> {
    fn deref_mut(&mut self) -> &mut Simulation {
        &mut self.step.episode.sim
    }
}

/// Step some episodes in lanes, at most `max_batch` at once, and reset those that have ended according to the autoreset
/// mode.
fn step_episodes<'a>(
    task: &Task,
    autoreset: Autoreset,
    (lanes, max_batch): (Width, usize),
    all: impl Iterator<Item = EpisodeStep<'a>>,
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
        if let Some(next) = all.peek() {
            next.episode.prefetch();
            prefetch(next.action);
            prefetch::<Outcome>(next.outcome);
        }
        present
    });
    let pending = prefetched.filter_map(|step| {
        if step.episode.status() == EpisodeStatus::Over {
            keep_error(step.reset(task));
            return None;
        }
        let begun = step.episode.begin_action(task, step.action);
        let until = step.episode.sim.next_action_time();
        Some((PendingAction { step, begun }, until))
    });
    let scheme = Scheme::from(task.scene().accuracy);
    advance_many(pending, scheme, (lanes, max_batch), |action| {
        let PendingAction { step, begun } = action;
        let result = step.episode.end_action(task, &begun);
        keep_error(step.end(task, autoreset, result));
    });
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

/// The episodes with their actions and results, in chunks of `chunk`.
fn in_chunks<'a>(
    task: &'a Task,
    chunk: usize,
    episodes: &'a mut [Episode],
    actions: &'a [f64],
    observations: &'a mut [f32],
    outcomes: &'a mut [Outcome],
) -> impl Iterator<Item = impl Iterator<Item = EpisodeStep<'a>>> {
    let (joints, width) = (task.joints(), task.observation.len());
    let results = observations
        .chunks_mut(chunk * width)
        .zip(outcomes.chunks_mut(chunk));
    episodes
        .chunks_mut(chunk)
        .zip(actions.chunks(chunk * joints))
        .zip(results)
        .map(move |((episodes, actions), (observations, outcomes))| {
            let results = observations.chunks_mut(width).zip(outcomes);
            let all = episodes.iter_mut().zip(actions.chunks(joints)).zip(results);
            all.map(|((episode, action), (observation, outcome))| EpisodeStep {
                episode,
                action,
                observation,
                outcome,
            })
        })
}

/// Number of episodes in a chunk.
fn chunk_size(n: usize, threads: usize) -> usize {
    let per_thread = n.div_ceil(threads);
    per_thread.div_ceil(CHUNKS_PER_THREAD).clamp(1, MAX_CHUNK)
}

/// Do the same work on up to `threads` threads, this one among them, which does not wait for another to wake up.
/// `work` gets a function that tells whether to go on: as soon as `go_on`, which only this thread calls, returns
/// false, it does so on all threads.
fn run_on(threads: usize, go_on: &dyn Fn() -> bool, work: impl Fn(&dyn Fn() -> bool) + Sync) {
    let stopped = AtomicBool::new(false);
    let others = || !stopped.load(Ordering::Relaxed);
    let own = || {
        let on = go_on();
        if !on {
            stopped.store(true, Ordering::Relaxed);
        }
        on
    };
    if threads > 1
        && let Some(pool) = pool()
    {
        pool.in_place_scope(|scope| {
            (1..threads).for_each(|_| scope.spawn(|_| work(&others)));
            work(&own);
        });
    } else {
        work(&own);
    }
}

/// The data of a mutex, also after a panic.
fn lock<T>(mutex: &Mutex<T>) -> std::sync::MutexGuard<'_, T> {
    mutex.lock().unwrap_or_else(PoisonError::into_inner)
}
