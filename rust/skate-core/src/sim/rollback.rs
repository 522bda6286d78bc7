//! What a simulation goes back to where it is refused something.

use crate::{
    events::guards::Guards,
    model::{Model, layout::NV},
    rhs::sole_points::Marks,
    sim::{Simulation, snapshot::Kept},
};
use std::sync::Arc;

/// Everything of a simulation that anybody may see, but for its events and steps; a workspace for evaluations
/// is several times as large.
#[derive(Debug)]
pub(crate) struct Past {
    model: Arc<Model>,
    kept: Kept,
    guards: Guards,
    marks: Marks,
    tau: [f64; NV],
    qdd: [f64; NV],
}

impl Simulation {
    pub(crate) fn present(&self) -> Past {
        Past {
            model: Arc::clone(&self.model),
            kept: self.kept(),
            guards: self.guards,
            marks: self.marks,
            tau: self.eval.tau,
            qdd: self.eval.qdd,
        }
    }

    pub(crate) fn put_back(&mut self, past: Past) {
        self.exchange(past.model).expect("its own coordinates");
        // What had ended may have no motion.
        self.put(&past.kept).ok();
        (self.guards, self.marks) = (past.guards, past.marks);
        (self.eval.tau, self.eval.qdd) = (past.tau, past.qdd);
    }

    /// Before a new beginning, which either `forget` or `go_back` follows.
    pub(crate) fn set_aside(&mut self) -> Past {
        self.events.set_aside();
        self.records.set_aside();
        self.present()
    }

    /// The beginning was one.
    pub(crate) fn forget(&mut self) {
        self.events.forget();
        self.records.forget();
    }

    /// The beginning was none.
    pub(crate) fn go_back(&mut self, past: Past) {
        self.events.go_back();
        self.records.go_back();
        self.put_back(past);
    }

    /// Has it the same model?
    pub(crate) fn is_like(&self, past: &Past) -> bool {
        Arc::ptr_eq(&self.model, &past.model)
    }
}
