//! Rollback state for refused calls.

use crate::{
    events::guards::Guards,
    model::{Model, layout::NV},
    rhs::sole_points::SolePoints,
    sim::{Simulation, snapshot::SnapshotState},
};
use std::sync::Arc;

/// Observable state of a simulation, without events and gait steps. It does not hold the evaluation's
/// workspace, which is several times larger.
#[derive(Debug)]
pub(crate) struct RollbackState {
    model: Arc<Model>,
    contents: SnapshotState,
    guards: Guards,
    sole_points: SolePoints,
    tau: [f64; NV],
    qdd: [f64; NV],
}

impl Simulation {
    pub(crate) fn rollback_state(&self) -> RollbackState {
        RollbackState {
            model: Arc::clone(&self.model),
            contents: self.snapshot_state(),
            guards: self.guards,
            sole_points: self.sole_points,
            tau: self.eval.tau,
            qdd: self.eval.qdd,
        }
    }

    pub(crate) fn restore_state(&mut self, saved: RollbackState) {
        self.set_model(saved.model).expect("the same coordinates");
        // A terminated simulation may have no valid motion; this error is expected.
        self.load_state(&saved.contents).ok();
        (self.guards, self.sole_points) = (saved.guards, saved.sole_points);
        (self.eval.tau, self.eval.qdd) = (saved.tau, saved.qdd);
    }

    /// Start a tentative reset; `commit_reset` or `roll_back` must follow.
    pub(crate) fn begin_tentative_reset(&mut self) -> RollbackState {
        self.events.begin_tentative_reset();
        self.records.begin_tentative_reset();
        self.rollback_state()
    }

    /// Accept the tentative reset.
    pub(crate) fn commit_reset(&mut self) {
        self.events.commit_reset();
        self.records.commit_reset();
    }

    /// Undo the tentative reset.
    pub(crate) fn roll_back(&mut self, saved: RollbackState) {
        self.events.roll_back();
        self.records.roll_back();
        self.restore_state(saved);
    }

    /// Whether the model is the same object.
    pub(crate) fn shares_model(&self, saved: &RollbackState) -> bool {
        Arc::ptr_eq(&self.model, &saved.model)
    }
}
