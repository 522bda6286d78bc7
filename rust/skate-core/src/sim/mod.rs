//! Simulation of one robot in time: integration within a contact mode, event location, event handling, queries,
//! snapshots, and an interface for external integrators. `moreau` is the alternative without event location.

mod advance;
mod budget;
mod event_lanes;
mod event_location;
pub mod gait_statistics;
mod guard_samples;
mod hybrid;
mod kick;
mod lanes;
mod log;
mod mode_system;
mod moreau;
mod observation;
mod queries;
mod rollback;
pub mod snapshot;
mod start;
mod step;
mod stiffness;
mod trial;

use crate::{
    control::{sample, sampled},
    error::Termination,
    events::{
        EventHandler,
        guards::{Guards, MOST},
        observer::Operation,
    },
    integrate::Step,
    model::{
        Model,
        contact_mode::ContactMode,
        controller_state::ControllerState,
        layout::{NV, ROOT},
        state::State,
    },
    rhs::{Evaluation, jacobian::Implicit, sole_points::SolePoints},
    scene::{Leg, Way},
    sim::gait_statistics::{GaitMonitor, StepRecord},
};
pub use advance::advance_many;
pub(crate) use advance::step_many;
pub(crate) use budget::Budget;
pub use budget::{most_evaluations, usual_evaluations};
use guard_samples::GuardSamples;
pub(crate) use kick::check_kick;
pub use lanes::HasSimulation;
pub(crate) use lanes::MAX_BATCH;
use log::BoundedLog;
pub use log::LOG_CAPACITY;
pub(crate) use moreau::{StepInputs, StepResult, repeat};
pub(crate) use observation::Observed;
pub(crate) use rollback::RollbackState;
use serde::{Deserialize, Serialize};
use std::sync::Arc;

/// Maximum size of the integrated vector: q, v and three powers.
pub(crate) const NY: usize = 2 * NV + 3;
/// Change of a residual torque that counts as a jump [N m].
const TORQUE_JUMP: f64 = 1.0;

/// Counters since the start.
#[derive(Debug, Clone, Copy, Default, PartialEq, Serialize, Deserialize)]
pub struct Stats {
    /// Accepted time steps.
    pub steps: u64,
    /// Rejected time steps.
    pub rejections: u64,
    /// Evaluations of the equations of motion.
    pub evaluations: u64,
    pub events: u64,
    /// Iterations to locate events.
    pub root_iterations: u64,
    /// Projections onto the constraints of the free foot.
    pub projections: u64,
    /// Factorisations of M + g D by implicit methods.
    pub factorisations: u64,
    /// Sum of the method's local error estimates, root mean square over all coordinates [rad, m]; 0 for
    /// fixed steps.
    pub error_estimate: f64,
}

/// Entry of the event log.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Event {
    /// [s]
    pub t: f64,
    /// Description of the guard, or `kick`.
    pub what: &'static str,
    /// Contact modes before and after.
    pub from: ContactMode,
    pub to: ContactMode,
    /// Supporting leg after the event.
    pub leg: Leg,
}

/// Simulation of one robot.
#[derive(Debug, Clone)]
pub struct Simulation {
    /// Shared by all simulations with the same parameters.
    pub model: Arc<Model>,
    pub state: State,
    /// Evaluation at `state`; after time-stepping only its forces are up to date.
    pub eval: Evaluation,
    /// Where `eval` was last evaluated in the attempted step, as a fraction of it; NaN elsewhere.
    eval_at: f64,
    /// Only lanes have evaluated there: of `eval`, only the contact forces are of that place.
    eval_is_partial: bool,
    /// Sole points at `state`.
    pub sole_points: SolePoints,
    pub stats: Stats,
    /// Cause of termination; None while the simulation can continue.
    pub ended: Option<Termination>,
    pub(crate) monitor: GaitMonitor,
    /// Guards of the present contact mode.
    guards: Guards,
    /// Guard values at `state`.
    pub(crate) values: [f64; MOST],
    /// Derivative of the integrated vector at `state`.
    pub(crate) dy: [f64; NY],
    /// Attempted step of the integration method.
    step: Step<NY>,
    /// Jacobian of implicit methods.
    pub(crate) implicit: Implicit,
    guard_samples: GuardSamples,
    /// Residual torques [N m].
    pub(crate) residual: [f64; NV],
    /// Averaging time of the contact forces: the last time step [s]; 0 if they are instantaneous.
    pub(crate) averaging_time: f64,
    /// The residual torque has jumped since the last time step.
    pub(crate) torque_jumped: bool,
    pub(crate) budget: Budget,
    pub(crate) observer: Observed,
    events: BoundedLog<Event>,
    records: BoundedLog<StepRecord>,
}

impl Simulation {
    /// Memory of the logs [bytes].
    pub(crate) const LOG_SIZE: usize = BoundedLog::<Event>::SIZE + BoundedLog::<StepRecord>::SIZE;

    /// Sample the controller.
    fn sample(&mut self) {
        let state = &mut self.state;
        let now = (state.t, state.support_leg, state.mode);
        let angle = state.free_foot_angle();
        let before = state.controller;
        sample(&self.model, now, angle, &mut state.controller);
        let after = state.controller;
        self.observe_operation(Operation::Sample(before, after));
    }

    /// Controller state after a sample at the present state.
    fn sampled(&self) -> ControllerState {
        sampled(&self.model, &self.state, self.state.free_foot_angle())
    }

    fn event_handler(&mut self) -> EventHandler<'_> {
        EventHandler::new(
            &self.model,
            &mut self.eval,
            &mut self.state,
            &mut self.residual,
            self.observer.0.as_deref_mut(),
        )
    }

    /// Set the residual joint torques [N m], n - 3 entries without the root. They are constant until the next call.
    pub fn hold(&mut self, torque: &[f64]) {
        let joints = &mut self.residual[ROOT..self.model.n];
        if joints == torque || self.ended.is_some() {
            return;
        }
        let jump = |(old, new): (&f64, &f64)| (new - old).abs() > TORQUE_JUMP;
        let jumps = joints.iter().zip(torque).any(jump);
        joints.copy_from_slice(torque);
        self.budget.add_call();
        if let Way::TimeSteps { .. } = self.model.scene.accuracy.way() {
            if jumps {
                (self.averaging_time, self.torque_jumped) = (0.0, true);
            }
            return;
        }
        if jumps {
            self.state.h = self.state.h.min(self.method().max_step_after_jump());
        }
        let resumed = self.resume();
        self.ended = resumed.err();
        self.update_counters();
    }

    /// Update the counters, and after termination the sole points.
    pub(crate) fn update_counters(&mut self) {
        if self.ended.is_some() {
            // Termination may have interrupted an event.
            let State { q, v, mode, .. } = &self.state;
            self.eval.set_planar_configuration(&self.model, *mode, q, v);
            self.sole_points = SolePoints::of_one(&self.model, &self.eval.kin, *mode, q[1]);
        }
        self.stats.evaluations = self.eval.count;
        self.stats.factorisations = self.implicit.count;
    }
}
