//! The last of what has happened, in memory that is asked for once: nobody need ever take it.

use std::collections::VecDeque;

/// As many entries are kept; the oldest go first.
pub const KEPT: usize = 1024;

/// See the module's documentation.
#[derive(Debug)]
pub(super) struct Log<T>(VecDeque<T>);

impl<T> Log<T> {
    pub fn new() -> Self {
        Self(VecDeque::with_capacity(KEPT))
    }

    pub fn push(&mut self, entry: T) {
        if self.0.len() == KEPT {
            self.0.pop_front();
        }
        self.0.push_back(entry);
    }

    /// What there is, in order; nothing is left.
    pub fn take(&mut self) -> Vec<T> {
        self.0.drain(..).collect()
    }

    pub fn clear(&mut self) {
        self.0.clear();
    }

    /// What there is, with its memory. What is left has none, so it is only for a few entries.
    pub fn set_aside(&mut self) -> Self {
        Self(std::mem::take(&mut self.0))
    }

    /// Go on in the memory of another, which is forgotten.
    pub fn take_room(&mut self, other: Self) {
        let own = std::mem::replace(&mut self.0, other.0);
        self.0.clear();
        self.0.extend(own);
    }
}

/// With room for as many entries: a derived one would have room for those that there are.
impl<T: Clone> Clone for Log<T> {
    fn clone(&self) -> Self {
        let mut log = Self::new();
        log.0.extend(self.0.iter().cloned());
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
        let room = log.0.capacity();
        let mut copy = log.clone();
        assert_eq!(copy.0.capacity(), room);
        assert_eq!(log.take(), (10..more).collect::<Vec<_>>());
        assert_eq!((log.take(), log.0.capacity()), (Vec::new(), room));
        assert_eq!(copy.take().len(), KEPT);
    }

    #[test]
    fn a_new_beginning_has_the_memory_of_the_old_one() {
        let mut log = Log::new();
        (0..10).for_each(|i| log.push(i));
        let room = log.0.capacity();
        let old = log.set_aside();
        assert_eq!((log.0.capacity(), old.0.len()), (0, 10));
        log.push(10);
        log.take_room(old);
        assert_eq!((log.take(), log.0.capacity()), (vec![10], room));
    }
}
