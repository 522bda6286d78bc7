//! The last of what has happened, in memory that is asked for once: nobody need ever take it.

use crate::numeric::prefetch::prefetch_line;
use std::collections::VecDeque;

/// As many entries are kept; the oldest go first.
pub const LOG_CAPACITY: usize = 1024;

/// See the module's documentation.
#[derive(Debug)]
pub(super) struct BoundedLog<T> {
    entries: VecDeque<T>,
    /// So many of them are from before a new beginning, and gone unless that is refused.
    saved: usize,
}

impl<T> BoundedLog<T> {
    pub fn new() -> Self {
        Self {
            entries: VecDeque::with_capacity(LOG_CAPACITY),
            saved: 0,
        }
    }

    pub fn push(&mut self, entry: T) {
        if self.entries.len() - self.saved == LOG_CAPACITY {
            self.entries.remove(self.saved);
        }
        self.entries.push_back(entry);
    }

    /// Ask for where the next entry goes.
    #[inline]
    pub fn prefetch(&self) {
        let (first, second) = self.entries.as_slices();
        let last = if second.is_empty() { first } else { second };
        prefetch_line(last.as_ptr_range().end.cast());
    }

    /// What there is, in order; nothing is left.
    pub fn take(&mut self) -> Vec<T> {
        self.entries.drain(self.saved..).collect()
    }

    pub fn clear(&mut self) {
        self.entries.truncate(self.saved);
    }

    /// Begin anew; `commit_reset` or `roll_back` follows.
    pub fn begin_tentative_reset(&mut self) {
        self.saved = self.entries.len();
    }

    /// Stay at the beginning.
    pub fn commit_reset(&mut self) {
        self.entries.drain(..self.saved);
        self.saved = 0;
    }

    /// As if it had not begun.
    pub fn roll_back(&mut self) {
        self.clear();
        self.saved = 0;
    }
}

/// With room for as many entries: a derived one would have room for those that there are.
impl<T: Clone> Clone for BoundedLog<T> {
    fn clone(&self) -> Self {
        let mut log = Self::new();
        log.entries.extend(self.entries.iter().cloned());
        log.saved = self.saved;
        log
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_last_entries_are_kept_in_order_and_taken_once() {
        let mut log = BoundedLog::new();
        let more = LOG_CAPACITY + 10;
        for i in 0..more {
            log.push(i);
        }
        let room = log.entries.capacity();
        let mut copy = log.clone();
        assert_eq!(copy.entries.capacity(), room);
        assert_eq!(log.take(), (10..more).collect::<Vec<_>>());
        assert_eq!((log.take(), log.entries.capacity()), (Vec::new(), room));
        assert_eq!(copy.take().len(), LOG_CAPACITY);
    }

    /// However full it was: what is set aside takes no room from what comes.
    #[test]
    fn a_beginning_is_forgotten_or_gone_back_from() {
        for before in [0, 10, LOG_CAPACITY] {
            for more in [0, 3, LOG_CAPACITY + 3] {
                let mut log = BoundedLog::new();
                (0..before).for_each(|i| log.push(i));
                log.begin_tentative_reset();
                log.push(0);
                log.clear();
                (0..more).for_each(|i| log.push(i));
                let mut other = log.clone();
                log.roll_back();
                other.commit_reset();
                assert_eq!(log.take(), (0..before).collect::<Vec<_>>());
                assert_eq!(
                    other.take(),
                    (more.saturating_sub(LOG_CAPACITY)..more).collect::<Vec<_>>()
                );
            }
        }
    }
}
