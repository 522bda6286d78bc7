//! Calls that may be refused work on a draft, which replaces the simulation if they succeed.

use crate::sim::Simulation;
use std::mem;

impl Simulation {
    /// A copy with empty logs; nothing is allocated.
    pub(crate) fn draft(&mut self) -> Self {
        let events = mem::take(&mut self.events);
        let records = mem::take(&mut self.records);
        let mut draft = self.clone();
        (self.events, self.records) = (events, records);
        draft.events = self.events.draft();
        draft.records = self.records.draft();
        draft
    }

    /// Continue as a draft, with its entries in the logs.
    pub(crate) fn replace(&mut self, mut draft: Self) {
        draft.adopt_logs(self);
        *self = draft;
    }

    /// Take over the memory of the logs from the simulation that this draft replaces.
    pub(crate) fn adopt_logs(&mut self, replaced: &mut Self) {
        self.events.adopt(&mut replaced.events);
        self.records.adopt(&mut replaced.records);
    }
}
