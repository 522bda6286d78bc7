//! What an observer of a motion is told: accepted time steps, and what events do to the state.

use crate::{
    events::guard::Guard,
    model::{
        Model,
        contact_mode::{ContactMode, Foot, SoleContact},
        controller_state::ControllerState,
        layout::NV,
        state::State,
    },
    rhs::Evaluation,
    scene::Leg,
};
use std::{any::Any, fmt::Debug};

/// One operation on the state.
#[derive(Debug, Clone, Copy)]
pub enum Operation {
    /// The pivot of the supporting foot moves along the sole.
    MovePivot { from: SoleContact, to: SoleContact },
    /// The free foot becomes the supporting foot; the mode before, and that foot in its new role.
    Swap(ContactMode, Foot),
    /// Constrained coordinates and velocities of the supporting foot become zero.
    ZeroConstrained(ContactMode),
    /// The free foot's contact point becomes the anchor.
    SetAnchor(ContactMode),
    /// Closed ends move onto the ice: the supporting foot's, and the free foot's if it is off the ice.
    CloseGaps { closed: ContactMode, projects: bool },
    /// Inelastic impact; with friction coefficients zero if the impulses are frictionless.
    Impact {
        mode: ContactMode,
        has_friction: bool,
    },
    /// Projection onto the free foot's constraints.
    Project(ContactMode),
    /// A phase of the feedforward begins: t1 or t2 becomes the time.
    PhaseBegins(usize),
    /// A controller sample: the controller's state before and after.
    Sample(ControllerState, ControllerState),
    /// The contact mode or the supporting leg has changed.
    Changed,
}

/// What ends a step.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum StepEnd {
    /// The step's length.
    Length,
    /// The end time of the motion.
    Until,
    Guard(Guard),
    /// A controller sample at a time that does not depend on the state.
    Sample,
}

/// The present state with its evaluation.
#[derive(Debug, Clone, Copy)]
pub struct Present<'a> {
    pub model: &'a Model,
    pub state: &'a State,
    /// Residual torques [N m].
    pub residual: &'a [f64; NV],
    pub eval: &'a Evaluation,
    /// Guards of the mode and their values.
    pub guards: &'a [Guard],
    pub values: &'a [f64],
}

/// A time step, or its part up to an event, before the projection onto the constraints.
#[derive(Clone, Copy)]
pub struct AcceptedStep<'a> {
    pub before: &'a State,
    pub after: &'a State,
    /// Length of the attempted step [s].
    pub h: f64,
    /// Part of it that was made.
    pub theta: f64,
    /// -dh/dt for the time t of the start: the length of a step is constant, or a share of the time left.
    pub share: f64,
    pub end: StepEnd,
    /// Angle of the free foot to the ice at a fraction of the attempted step [rad].
    pub free_foot_angle: &'a dyn Fn(f64) -> f64,
}

/// Observer of a motion. Without one nothing is computed for it.
pub trait Observer: Any + Debug + Send + Sync {
    /// The observer of a copy of the motion.
    fn copy(&self) -> Option<Box<dyn Observer>> {
        None
    }
    /// The motion has another state than before, without an event: a start, a restored one, a kick.
    fn begins(&mut self, _model: &Model, _state: &State) {}
    /// The state changes.
    fn operation(&mut self, operation: Operation);
    /// A time step was accepted and its end projected onto the constraints.
    fn step(&mut self, present: &Present<'_>, step: &AcceptedStep<'_>);
    /// The same with time stepping: from `start`, of the length `h` with the share of `AcceptedStep`, up to a landing.
    fn time_step(
        &mut self,
        present: &Present<'_>,
        start: &State,
        lengths: (f64, f64),
        landing: Option<Guard>,
    );
    /// The event of a guard begins.
    fn event(&mut self, present: &Present<'_>, guard: Guard);
    /// It is over; mode and supporting leg before it.
    fn event_ends(&mut self, present: &Present<'_>, guard: Guard, before: (ContactMode, Leg));
}
