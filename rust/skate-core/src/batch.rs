//! Many episodes at once. What becomes of one depends neither on the others nor on the number of threads.

use crate::{
    error::Invalid,
    numeric::{prefetch::prefetch, simd::Width},
    sim::{HasSimulation, Simulation, advance_many},
    task::{Begun, Episode, Rollback, Row, Stage, Start, Task},
};
use rayon::{ThreadPool, ThreadPoolBuilder, prelude::*};
use std::{
    cell::Cell,
    iter, process,
    sync::{Arc, Mutex, PoisonError},
    thread,
};

/// A thread takes that many pieces of a step's episodes, if all are equally fast, of so many episodes at most.
const PIECES: usize = 16;
const LARGEST: usize = 16;

/// What follows the end of an episode, as Gymnasium names it.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Autoreset {
    /// The next step resets, whatever its action.
    NextStep,
    /// The same step resets; what the episode ended with is kept aside.
    SameStep,
    /// Somebody has to ask.
    Disabled,
}

/// See the module's documentation.
pub struct Batch {
    pub task: Task,
    pub episodes: Vec<Episode>,
    autoreset: Autoreset,
    threads: usize,
    /// A step has been made, after which nobody waits for a reset.
    ready: bool,
    /// Of vector registers, over which fixed steps are spread.
    pub lanes: Width,
}

/// What an episode ended with, in a step that has also reset it.
#[derive(Debug, Clone)]
pub struct Last {
    pub row: Row,
    pub observation: Vec<f32>,
}

/// What a step came to for one episode.
pub type Outcome = (Row, Option<Box<Last>>);

impl Batch {
    /// `n` episodes that wait for their first reset, advanced by up to `threads` threads; None for all cores.
    ///
    /// # Errors
    /// `Invalid` where the scene's start is not one, or a count is 0.
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

    /// Begin episodes; of several starts of one the last counts.
    ///
    /// # Errors
    /// `Invalid`, and nothing has changed, where one has no such start.
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
        let begin = |(episode, start, past): &mut Reset| {
            *past = Some(episode.begin(task, start)?);
            Ok(())
        };
        let begun = if self.threads == 1 || resets.len() == 1 {
            resets.iter_mut().try_for_each(begin)
        } else {
            let share = resets.len().div_ceil(self.threads).max(1);
            let shares = resets.par_iter_mut().with_min_len(share);
            pool().install(|| shares.try_for_each(begin))
        };
        for (episode, start, past) in resets {
            match past {
                Some(past) if begun.is_ok() => episode.settle(&past, start),
                Some(past) => episode.roll_back(past),
                None => {}
            }
        }
        begun
    }

    /// The first episode that cannot make a step, and its stage.
    pub fn waiting(&self) -> Option<(usize, Stage)> {
        // Where they are many, looking at each takes its time.
        if self.ready {
            return None;
        }
        let mut stages = self.episodes.iter().map(Episode::stage).enumerate();
        stages.find(|&(_, stage)| match stage {
            Stage::New => true,
            Stage::Over => self.autoreset == Autoreset::Disabled,
            Stage::Running => false,
        })
    }

    /// Make a step of every episode; `actions` are finite, `observations` and `outcomes` have room for all.
    ///
    /// # Errors
    /// `Invalid` where an episode that is over finds no start; the others have gone on.
    pub fn step(
        &mut self,
        actions: &[f64],
        observations: &mut [f32],
        outcomes: &mut [Outcome],
    ) -> Result<(), Invalid> {
        let (joints, width) = (self.task.joints(), self.task.observation.len());
        let n = self.episodes.len();
        let threads = self.threads.min(n);
        let share = n.div_ceil(threads);
        self.ready = false;
        let piece = share.div_ceil(PIECES).min(LARGEST);
        let pieces = self
            .episodes
            .chunks_mut(piece)
            .zip(actions.chunks(piece * joints))
            .zip(observations.chunks_mut(piece * width))
            .zip(outcomes.chunks_mut(piece));
        let pieces = Mutex::new(pieces);
        let next = || pieces.lock().unwrap_or_else(PoisonError::into_inner).next();
        let (task, rules) = (&self.task, (self.autoreset, self.lanes, share));
        let done = Mutex::new(Ok(()));
        let work = || {
            let all = iter::from_fn(next).flat_map(|(((episodes, actions), seen), outcomes)| {
                let results = seen.chunks_mut(width).zip(outcomes);
                episodes.iter_mut().zip(actions.chunks(joints)).zip(results)
            });
            if let Err(invalid) = some(task, rules, all) {
                *done.lock().unwrap_or_else(PoisonError::into_inner) = Err(invalid);
            }
        };
        if threads == 1 {
            work();
        } else {
            // This thread works as well, and waits for nobody to wake up.
            pool().in_place_scope(|scope| {
                (1..threads).for_each(|_| scope.spawn(|_| work()));
                work();
            });
        }
        done.into_inner().unwrap_or_else(PoisonError::into_inner)?;
        self.ready = self.autoreset != Autoreset::Disabled;
        Ok(())
    }

    /// Undo an episode to a snapshot.
    ///
    /// # Errors
    /// As `Episode::restore`, and nothing has changed.
    pub fn restore(&mut self, i: usize, data: &[u8]) -> Result<(), Invalid> {
        self.episodes[i].restore(data)?;
        self.ready = false;
        Ok(())
    }
}

/// An episode, how it is to begin, and what it was before it did.
type Reset<'a> = (&'a mut Episode, &'a Start, Option<Rollback>);

/// An episode on its way through a step, and where its observation and its outcome go.
struct Rider<'a> {
    episode: &'a mut Episode,
    begun: Begun,
    observation: &'a mut [f32],
    outcome: &'a mut Outcome,
}

impl HasSimulation for Rider<'_> {
    fn sim(&self) -> &Simulation {
        &self.episode.sim
    }

    fn sim_mut(&mut self) -> &mut Simulation {
        &mut self.episode.sim
    }
}

/// A step of some episodes under their actions, and their resets where the mode asks for them.
fn some<'a>(
    task: &Task,
    (autoreset, lanes, most): (Autoreset, Width, usize),
    all: impl Iterator<
        Item = (
            (&'a mut Episode, &'a [f64]),
            (&'a mut [f32], &'a mut Outcome),
        ),
    >,
) -> Result<(), Invalid> {
    let done = Cell::new(Ok(()));
    let keep = |made: Result<(), Invalid>| {
        if made.is_err() {
            done.set(made);
        }
    };
    let mut all = all.peekable();
    let fetched = iter::from_fn(|| {
        let one = all.next();
        if let Some(((next, action), (_, outcome))) = all.peek() {
            next.prefetch();
            prefetch(*action);
            prefetch::<Outcome>(outcome);
        }
        one
    });
    let riders = fetched.filter_map(|((episode, action), (observation, outcome))| {
        if episode.stage() == Stage::Over {
            let begun = episode.reset(task, &Start::default());
            if begun.is_ok() {
                *outcome = (episode.row(), None);
            }
            keep(begun);
            episode.observe(task, observation);
            return None;
        }
        let begun = episode.begin_action(task, action);
        let until = episode.sim.next_action_time();
        let rider = Rider {
            episode,
            begun,
            observation,
            outcome,
        };
        Some((rider, until))
    });
    advance_many(riders, task.scene().accuracy, (lanes, most), |rider| {
        let Rider {
            episode,
            begun,
            observation,
            outcome,
        } = rider;
        let row = episode.end_action(task, &begun);
        *outcome = (row, None);
        if autoreset == Autoreset::SameStep && episode.stage() == Stage::Over {
            keep(restarted(task, episode, row).map(|made| *outcome = made));
        }
        episode.observe(task, observation);
    });
    done.into_inner()
}

/// An episode that is over begins anew; what it ended with is kept.
fn restarted(task: &Task, episode: &mut Episode, row: Row) -> Result<Outcome, Invalid> {
    let mut observation = vec![0.0; task.observation.len()];
    episode.observe(task, &mut observation);
    episode.reset(task, &Start::default())?;
    let begun = Row {
        info: episode.row().info,
        ..row
    };
    Ok((begun, Some(Box::new(Last { row, observation }))))
}

/// The one pool of this process, with a thread for every core. Threads do not survive a fork: a child makes its
/// own.
fn pool() -> Arc<ThreadPool> {
    static POOL: Mutex<Option<(u32, Arc<ThreadPool>)>> = Mutex::new(None);
    let mut held = POOL.lock().unwrap_or_else(PoisonError::into_inner);
    match &*held {
        Some((owner, pool)) if *owner == process::id() => pool.clone(),
        _ => {
            let pool = ThreadPoolBuilder::new().num_threads(cores()).build();
            let pool = Arc::new(pool.expect("the system has threads"));
            // The parent's threads are not there to be joined.
            if let Some((_, dead)) = held.replace((process::id(), pool.clone())) {
                std::mem::forget(dead);
            }
            pool
        }
    }
}

/// Cores that this process may use.
fn cores() -> usize {
    thread::available_parallelism().map_or(1, usize::from)
}
