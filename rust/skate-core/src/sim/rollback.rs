//! What a simulation goes back to where it is refused something.

use crate::{
    events::guards::Guards,
    model::{Model, layout::NV},
    rhs::sole_points::SolePoints,
    sim::{Simulation, snapshot::Kept},
};
use std::sync::Arc;

/// Everything of a simulation that anybody may see, but for its events and steps; a workspace for evaluations
/// is several times as large.
#[derive(Debug)]
pub(crate) struct Rollback {
    model: Arc<Model>,
    kept: Kept,
    guards: Guards,
    sole_points: SolePoints,
    tau: [f64; NV],
    qdd: [f64; NV],
}

impl Simulation {
    pub(crate) fn present(&self) -> Rollback {
        Rollback {
            model: Arc::clone(&self.model),
            kept: self.kept(),
            guards: self.guards,
            sole_points: self.sole_points,
            tau: self.eval.tau,
            qdd: self.eval.qdd,
        }
    }

    pub(crate) fn put_back(&mut self, past: Rollback) {
        self.exchange(past.model).expect("its own coordinates");
        // What had ended may have no motion.
        self.put(&past.kept).ok();
        (self.guards, self.sole_points) = (past.guards, past.sole_points);
        (self.eval.tau, self.eval.qdd) = (past.tau, past.qdd);
    }

    /// Before a new beginning, which either `forget` or `roll_back` follows.
    pub(crate) fn save_for_rollback(&mut self) -> Rollback {
        self.events.save_for_rollback();
        self.records.save_for_rollback();
        self.present()
    }

    /// The beginning was one.
    pub(crate) fn forget(&mut self) {
        self.events.forget();
        self.records.forget();
    }

    /// The beginning was none.
    pub(crate) fn roll_back(&mut self, past: Rollback) {
        self.events.roll_back();
        self.records.roll_back();
        self.put_back(past);
    }

    /// Has it the same model?
    pub(crate) fn is_like(&self, past: &Rollback) -> bool {
        Arc::ptr_eq(&self.model, &past.model)
    }
}
