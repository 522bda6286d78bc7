//! Bounded log of recent entries, allocated once.

use crate::numeric::prefetch::prefetch_line;
use std::{collections::VecDeque, mem};

/// Maximum number of entries; the oldest are dropped first.
pub const LOG_CAPACITY: usize = 1024;

/// Capacity of the log of a draft, enough for the entries of a start.
const DRAFT_CAPACITY: usize = 16;

/// Log with a fixed capacity. The default has no memory yet.
#[derive(Debug)]
pub(super) struct BoundedLog<T> {
    entries: VecDeque<T>,
    /// Memory for the entries of a draft; empty.
    spare: VecDeque<T>,
}

impl<T> BoundedLog<T> {
    /// Memory of the entries [bytes].
    pub const SIZE: usize = LOG_CAPACITY * size_of::<T>();

    pub fn new() -> Self {
        Self {
            entries: VecDeque::with_capacity(LOG_CAPACITY),
            spare: VecDeque::with_capacity(DRAFT_CAPACITY),
        }
    }

    pub fn push(&mut self, entry: T) {
        if self.entries.len() == LOG_CAPACITY {
            self.entries.pop_front();
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
        self.entries.drain(..).collect()
    }

    pub fn clear(&mut self) {
        self.entries.clear();
    }

    /// An empty log for a draft, in the spare memory.
    pub fn draft(&mut self) -> Self {
        Self {
            entries: mem::take(&mut self.spare),
            spare: VecDeque::new(),
        }
    }

    /// Take over the memory of the log of which this one is a draft; that log's entries are dropped.
    pub fn adopt(&mut self, replaced: &mut Self) {
        replaced.clear();
        replaced.entries.append(&mut self.entries);
        self.spare = mem::take(&mut self.entries);
        self.entries = mem::take(&mut replaced.entries);
    }
}

impl<T> Default for BoundedLog<T> {
    fn default() -> Self {
        Self {
            entries: VecDeque::new(),
            spare: VecDeque::new(),
        }
    }
}

/// Keeps the capacity; a derived implementation allocates for the present entries only.
impl<T: Clone> Clone for BoundedLog<T> {
    fn clone(&self) -> Self {
        let mut entries = VecDeque::with_capacity(self.entries.capacity());
        entries.extend(self.entries.iter().cloned());
        let spare = VecDeque::with_capacity(self.spare.capacity());
        Self { entries, spare }
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

    #[test]
    fn a_draft_adopts_the_memory_of_the_log() {
        let mut log = BoundedLog::new();
        let room = (log.entries.capacity(), log.spare.capacity());
        log.push(0);
        let mut draft = log.draft();
        (1..4).for_each(|i| draft.push(i));
        assert_eq!(log.entries, [0]);
        draft.adopt(&mut log);
        assert_eq!((draft.entries.capacity(), draft.spare.capacity()), room);
        assert_eq!(draft.take(), [1, 2, 3]);
    }
}
