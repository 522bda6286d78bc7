//! Simulation of one robot in time, as a hybrid system with located events.
//!
//! In the contact mode m the state x = (q, v) flows by dx/dt = f(t, x; m, c, u). The controller's state c is constant
//! between two samples, the residual torques u between two calls. Guards g(t, x) of the mode are positive while it
//! lasts. Where one falls through zero, a reset maps the state x- before the event to x+ and selects the next mode. A
//! sample that changes c is an event, too.
//!
//! ```text
//! advance from t to t_end, given x, m, c, u, h; f and g at (t, x):          advance_between_events
//!   while t < t_end:
//!     repeat:
//!       h := min(h, t_end - t)                                                Trial::shorten
//!       x1, error := step of the method from x by f over h                    compute
//!       next h := h factor(error)                                             judge
//!     until error <= 1
//!     theta := first zero of g, or first sample that changes c, in (0, 1]     first_event
//!     t, x := t + theta h, dense output there                                 accept
//!     x := projection onto the constraints of m                               rhs::projection::project
//!     if a guard is zero there:
//!       repeat:                                                               handle_event
//!         m, x+ := reset of the guard at x-                                   EventHandler::handle
//!         f, g := their values at (t, x+) in the new mode                     begin_mode
//!       until g > 0                                                           immediate_guard
//!     if c changes there:
//!       c := sample at (t, x); handle events of the new torques               sample, resume
//! ```
//!
//! The flow f is `mode_system::ModeSystem`, the guards are `events::guards::Guards`. `hybrid` has f, g and the resets for
//! external integrators, `crate::lanes` the same steps for many robots.

mod budget;
mod coordinates;
mod draft;
mod event_location;
pub mod gait_statistics;
pub(crate) mod guard_samples;
mod hybrid;
mod initial_contacts;
mod kick;
mod log;
pub(crate) mod mode_system;
mod observation;
mod queries;
pub mod snapshot;
mod start;
mod step;
mod stiffness;
pub(crate) mod trial;

pub use coordinates::Coordinates;

use crate::{
    control::{sample, sampled},
    error::Termination,
    events::{
        EventHandler,
        guards::{Guards, MAX_GUARDS},
        observer::Operation,
    },
    integrate::TimeStep,
    model::{
        Model,
        contact_mode::ContactMode,
        controller_state::ControllerState,
        layout::{NV, ROOT},
        state::State,
    },
    numeric::prefetch::prefetch,
    rhs::{Evaluation, jacobian::Implicit, sole_points::SolePoints},
    scene::Leg,
    sim::gait_statistics::{GaitMonitor, GaitStep},
};
pub(crate) use budget::Budget;
pub use budget::most_evaluations;
use guard_samples::GuardSamples;
pub(crate) use kick::check_kick;
use log::BoundedLog;
pub use log::LOG_CAPACITY;
pub(crate) use observation::Observed;
use serde::{Deserialize, Serialize};
use std::sync::Arc;
use trial::Evaluated;

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
    /// Where in the attempted step `eval` was evaluated.
    pub(crate) evaluated: Evaluated,
    /// Sole points at `state`.
    pub sole_points: SolePoints,
    pub stats: Stats,
    /// Cause of termination; None while the simulation can continue.
    pub ended: Option<Termination>,
    pub(crate) monitor: GaitMonitor,
    /// Guards of the present contact mode.
    pub(crate) guards: Guards,
    /// Guard values at `state`.
    pub(crate) values: [f64; MAX_GUARDS],
    /// Derivative of the integrated vector at `state`.
    pub(crate) dy: [f64; NY],
    /// Attempted step of the integration method.
    pub(crate) step: TimeStep<NY>,
    /// Jacobian of implicit methods.
    pub(crate) implicit: Implicit,
    pub(crate) guard_samples: GuardSamples,
    /// Residual torques [N m].
    pub(crate) residual: [f64; NV],
    /// Averaging time of the contact forces: the last time step [s]; 0 if they are instantaneous.
    pub(crate) averaging_time: f64,
    /// The residual torque has jumped since the last time step.
    pub(crate) torque_jumped: bool,
    pub(crate) budget: Budget,
    pub(crate) observer: Observed,
    events: BoundedLog<Event>,
    records: BoundedLog<GaitStep>,
}

impl Simulation {
    /// Memory of the logs [bytes].
    pub(crate) const LOG_SIZE: usize = BoundedLog::<Event>::SIZE + BoundedLog::<GaitStep>::SIZE;

    /// Sample the controller.
    pub(crate) fn sample(&mut self) {
        let state = &mut self.state;
        let now = (state.t, state.support_leg, state.mode);
        let angle = state.free_foot_angle();
        let before = state.controller;
        sample(&self.model, now, angle, &mut state.controller);
        let after = state.controller;
        self.observe_operation(Operation::Sample(before, after));
    }

    /// Controller state after a sample at the present state.
    pub(crate) fn sampled(&self) -> ControllerState {
        sampled(&self.model, &self.state, self.state.free_foot_angle())
    }

    pub(crate) fn event_handler(&mut self) -> EventHandler<'_> {
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
        if self.model.scheme.locates_events() {
            if jumps {
                self.state.h = self.state.h.min(self.method().max_step_after_jump());
            }
            self.ended = self.resume().err();
            self.update_counters();
        } else if jumps {
            (self.averaging_time, self.torque_jumped) = (0.0, true);
        }
    }

    /// Prefetch the data that a time step reads first.
    #[inline]
    pub(crate) fn prefetch(&self) {
        prefetch(&self.state);
        prefetch(&self.sole_points);
        prefetch(&self.eval.solution);
        prefetch(&self.eval.count);
        prefetch(&self.stats);
        prefetch(&self.monitor);
        prefetch(&self.residual);
        prefetch(&self.budget);
        prefetch(&self.ended);
        prefetch(&self.implicit.count);
        prefetch(&self.events);
    }

    /// Prefetch the event log; needs the data of `prefetch`.
    #[inline]
    pub(crate) fn prefetch_log(&self) {
        self.events.prefetch();
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
