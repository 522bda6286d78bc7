//! Record of a motion for its derivative: accepted time steps, and what events do to the state.

use crate::{
    contact::equations::Slip,
    events::guard::Guard,
    model::{
        contact_mode::{ContactMode, Foot, SoleContact},
        controller_state::ControllerState,
        layout::NV,
        state::State,
    },
    rhs::StepContext,
};

/// One operation on the state.
#[derive(Debug, Clone)]
pub enum Record {
    /// An accepted time step, or its part up to an event.
    Step(Box<StepRecord>),
    /// The event of a guard begins; its value and the state before.
    Event(Guard, f64, Box<State>),
    /// The event is over; the state after it, and the guard of the new mode that is nearest to zero.
    EventEnds(Box<State>, Option<(Guard, f64)>),
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
    /// Totals that the step before has added to: loaded slide, time of flight.
    Counted { slide: bool, flight: bool },
    /// The contact mode or the supporting leg has changed.
    Changed,
    /// A step of time stepping.
    TimeStep(Box<TimeStepRecord>),
}

/// An accepted time step.
#[derive(Debug, Clone)]
pub struct StepRecord {
    /// State at the start.
    pub start: State,
    pub context: StepContext,
    /// Length of the attempted step [s].
    pub h: f64,
    /// -dh/dt for the time t of the start: the length of a step is constant, or a share of the time left.
    pub share: f64,
    /// Part of the step that was made, up to an event.
    pub theta: f64,
    pub end: StepEnd,
    /// Least distance of the free foot's angle from a switch of Eq. 21 at a controller sample [rad].
    pub switch_margin: f64,
    /// State at the end.
    pub after: State,
}

/// A step of time stepping, without what happens before and after it.
#[derive(Debug, Clone)]
pub struct TimeStepRecord {
    pub start: State,
    pub residual: [f64; NV],
    /// [s]
    pub h: f64,
    /// As in `StepRecord`.
    pub share: f64,
    /// Landing that ends it.
    pub landing: Option<Guard>,
    /// State at the end.
    pub after: State,
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

/// The records of a motion.
#[derive(Debug, Clone, Default)]
pub struct Trace {
    pub records: Vec<Record>,
}

impl Record {
    /// An impact with the friction coefficients `slip`.
    pub(super) fn impact(mode: ContactMode, slip: Slip) -> Self {
        let has_friction = slip.support != 0.0 || slip.free != 0.0;
        Self::Impact { mode, has_friction }
    }
}
