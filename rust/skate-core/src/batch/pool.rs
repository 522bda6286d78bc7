//! Thread pool of the process.

use crate::numeric::{random, stack::STACK};
use rayon::{ThreadPool, ThreadPoolBuilder};
use std::{
    process, ptr,
    sync::atomic::{AtomicPtr, Ordering},
    thread,
};

/// Pool and the process that has made it.
struct Owned {
    process: u32,
    /// None if the system starts no thread.
    pool: Option<ThreadPool>,
}

/// Thread pool of this process, one thread per core; fewer if the system does not start as many, None if it starts
/// none. Threads do not survive a fork, so a child process creates its own pool. There is no lock, which another
/// thread might hold at a fork: the child would wait for it forever.
pub(super) fn pool() -> Option<&'static ThreadPool> {
    static POOL: AtomicPtr<Owned> = AtomicPtr::new(ptr::null_mut());
    let process = process::id();
    let mut held = POOL.load(Ordering::Acquire);
    loop {
        // SAFETY: the pointer is null or comes from `Box::into_raw` below; what has been stored is never freed.
        if let Some(owned) = unsafe { held.as_ref() }
            && owned.process == process
        {
            return owned.pool.as_ref();
        }
        let pool = build(cores());
        let made = Box::into_raw(Box::new(Owned { process, pool }));
        match POOL.compare_exchange(held, made, Ordering::AcqRel, Ordering::Acquire) {
            // A pool of the parent process stays in memory: its threads do not exist here and cannot be joined.
            Ok(_) => held = made,
            Err(other) => {
                // SAFETY: `made` comes from `Box::into_raw` above and has not been stored.
                drop(unsafe { Box::from_raw(made) });
                held = other;
            }
        }
    }
}

/// Pool of `threads` threads, or of as many as the system starts.
fn build(threads: usize) -> Option<ThreadPool> {
    let halves = std::iter::successors(Some(threads), |&threads| Some(threads / 2));
    halves
        .take_while(|&threads| threads > 0)
        .find_map(|threads| {
            let pool = ThreadPoolBuilder::new().num_threads(threads);
            pool.stack_size(2 * STACK).build().ok()
        })
}

/// Initialise what the threads of a pool, and random numbers, would initialise once per process. A child process that is forked while
/// another thread does so would wait for that thread forever.
pub fn initialise_statics() {
    drop(crossbeam_epoch::pin());
    random::initialise_statics();
}

/// Number of cores available to this process.
pub(super) fn cores() -> usize {
    thread::available_parallelism().map_or(1, usize::from)
}
