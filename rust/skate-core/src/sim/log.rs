//! Bounded log of recent entries, allocated once.

use crate::numeric::prefetch::prefetch_line;
use std::collections::VecDeque;

/// Maximum number of entries; the oldest are dropped first.
pub const LOG_CAPACITY: usize = 1024;

/// Log with a fixed capacity and support for a tentative reset.
#[derive(Debug)]
pub(super) struct BoundedLog<T> {
    entries: VecDeque<T>,
    /// Number of leading entries from before a tentative reset.
    saved: usize,
}

impl<T> BoundedLog<T> {
    /// Memory of the entries [bytes].
    pub const SIZE: usize = LOG_CAPACITY * size_of::<T>();

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

    /// Prefetch the memory of the next entry.
    #[inline]
    pub fn prefetch(&self) {
        let (first, second) = self.entries.as_slices();
        let last = if second.is_empty() { first } else { second };
        prefetch_line(last.as_ptr_range().end.cast());
    }

    /// Remove and return all entries in order.
    pub fn take(&mut self) -> Vec<T> {
        self.entries.drain(self.saved..).collect()
    }

    pub fn clear(&mut self) {
        self.entries.truncate(self.saved);
    }

    /// Start a tentative reset; `commit_reset` or `roll_back` must follow.
    pub fn begin_tentative_reset(&mut self) {
        self.saved = self.entries.len();
    }

    /// Drop the entries from before the reset.
    pub fn commit_reset(&mut self) {
        self.entries.drain(..self.saved);
        self.saved = 0;
    }

    /// Restore the entries from before the reset.
    pub fn roll_back(&mut self) {
        self.clear();
        self.saved = 0;
    }
}

/// Keeps the full capacity; a derived implementation allocates for the present entries only.
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
    fn the_log_keeps_the_last_entries_in_order() {
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

    /// Saved entries do not reduce the capacity for new ones.
    #[test]
    fn a_tentative_reset_is_committed_or_rolled_back() {
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
