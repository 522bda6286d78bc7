//! The last of what has happened, in memory that is asked for once: nobody need ever take it.

use crate::numeric::prefetch::prefetch_line;
use std::collections::VecDeque;

/// As many entries are kept; the oldest go first.
pub const KEPT: usize = 1024;

/// See the module's documentation.
#[derive(Debug)]
pub(super) struct Log<T> {
    entries: VecDeque<T>,
    /// So many of them are from before a new beginning, and gone unless that is refused.
    aside: usize,
}

impl<T> Log<T> {
    pub fn new() -> Self {
        Self {
            entries: VecDeque::with_capacity(KEPT),
            aside: 0,
        }
    }

    pub fn push(&mut self, entry: T) {
        if self.entries.len() - self.aside == KEPT {
            self.entries.remove(self.aside);
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
        self.entries.drain(self.aside..).collect()
    }

    pub fn clear(&mut self) {
        self.entries.truncate(self.aside);
    }

    /// Begin anew; `forget` or `roll_back` follows.
    pub fn save_for_rollback(&mut self) {
        self.aside = self.entries.len();
    }

    /// Stay at the beginning.
    pub fn forget(&mut self) {
        self.entries.drain(..self.aside);
        self.aside = 0;
    }

    /// As if it had not begun.
    pub fn roll_back(&mut self) {
        self.clear();
        self.aside = 0;
    }
}

/// With room for as many entries: a derived one would have room for those that there are.
impl<T: Clone> Clone for Log<T> {
    fn clone(&self) -> Self {
        let mut log = Self::new();
        log.entries.extend(self.entries.iter().cloned());
        log.aside = self.aside;
        log
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_last_entries_are_kept_in_order_and_taken_once() {
        let mut log = Log::new();
        let more = KEPT + 10;
        for i in 0..more {
            log.push(i);
        }
        let room = log.entries.capacity();
        let mut copy = log.clone();
        assert_eq!(copy.entries.capacity(), room);
        assert_eq!(log.take(), (10..more).collect::<Vec<_>>());
        assert_eq!((log.take(), log.entries.capacity()), (Vec::new(), room));
        assert_eq!(copy.take().len(), KEPT);
    }

    /// However full it was: what is set aside takes no room from what comes.
    #[test]
    fn a_beginning_is_forgotten_or_gone_back_from() {
        for before in [0, 10, KEPT] {
            for more in [0, 3, KEPT + 3] {
                let mut log = Log::new();
                (0..before).for_each(|i| log.push(i));
                log.save_for_rollback();
                log.push(0);
                log.clear();
                (0..more).for_each(|i| log.push(i));
                let mut other = log.clone();
                log.roll_back();
                other.forget();
                assert_eq!(log.take(), (0..before).collect::<Vec<_>>());
                assert_eq!(
                    other.take(),
                    (more.saturating_sub(KEPT)..more).collect::<Vec<_>>()
                );
            }
        }
    }
}
