//! What a simulation goes back to where it is refused something.

use super::{Event, Log, Simulation};
use crate::{
    guards::Guards,
    marks::Marks,
    model::{Model, NV},
    monitor::StepRecord,
    snapshot::Kept,
};
use std::sync::Arc;

/// Everything of a simulation that anybody may see, but for its events and steps; a workspace for evaluations
/// is several times as large.
#[derive(Debug)]
pub(crate) struct Present {
    model: Arc<Model>,
    kept: Kept,
    guards: Guards,
    marks: Marks,
    tau: [f64; NV],
    qdd: [f64; NV],
}

/// The same with events and steps.
#[derive(Debug)]
pub(crate) struct Past {
    present: Present,
    events: Log<Event>,
    records: Log<StepRecord>,
}

impl Simulation {
    pub(crate) fn present(&self) -> Present {
        Present {
            model: Arc::clone(&self.model),
            kept: self.kept(),
            guards: self.guards,
            marks: self.marks,
            tau: self.eval.tau,
            qdd: self.eval.qdd,
        }
    }

    pub(crate) fn put_back(&mut self, present: Present) {
        self.exchange(present.model).expect("its own coordinates");
        // What had ended may have no motion.
        self.put(&present.kept).ok();
        (self.guards, self.marks) = (present.guards, present.marks);
        (self.eval.tau, self.eval.qdd) = (present.tau, present.qdd);
    }

    /// Before a new beginning, which either `forget` or `go_back` follows.
    pub(crate) fn set_aside(&mut self) -> Past {
        Past {
            present: self.present(),
            events: self.events.set_aside(),
            records: self.records.set_aside(),
        }
    }

    /// The beginning was one. Has it another model?
    pub(crate) fn forget(&mut self, past: Past) -> bool {
        self.events.take_room(past.events);
        self.records.take_room(past.records);
        !Arc::ptr_eq(&self.model, &past.present.model)
    }

    /// The beginning was none.
    pub(crate) fn go_back(&mut self, past: Past) {
        (self.events, self.records) = (past.events, past.records);
        self.put_back(past.present);
    }
}
