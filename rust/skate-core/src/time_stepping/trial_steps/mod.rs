//! Trial steps that make up one step: the full step, and if contacts change in it, shorter steps that locate the
//! change. `TrialSteps` requests one trial after the other; the caller computes it, alone or in SIMD lanes.

mod landing;
mod release;

use crate::{
    contact::equations::Solution,
    dynamics::centre_of_mass::CentreOfMass,
    error::Termination,
    events::{guard::Guard, guards::Guards},
    model::{
        contact_mode::{ContactMode, End, Foot, SoleContact, touches},
        state::State,
    },
    rhs::sole_points::SolePoints,
    sim::Simulation,
    time_stepping::{step_contacts::ModeConstraint, step_length::SHORTEST},
};
use landing::{Landing, MAX_LANDING_TRIALS};
use release::MeanLoad;

/// Maximum number of restarts of a step after a change of contacts at its start.
const MAX_RESTARTS: u32 = 8;
/// A change of contacts within this fraction of a step happens at its start.
const START_FRACTION: f64 = 0.01;

/// A requested step of length `h` [s] from `start`.
#[derive(Debug, Clone, Copy)]
pub struct StepRequest {
    pub start: State,
    /// At the start.
    pub centre: CentreOfMass,
    pub h: f64,
    pub constraint: ModeConstraint,
}

/// Mean forces over a completed step of length `h` [s].
#[derive(Debug, Clone, Copy)]
pub(super) struct MeanForces {
    pub forces: Solution,
    pub h: f64,
}

/// The trials of one step.
#[derive(Debug, Clone)]
pub(super) struct TrialSteps {
    pub request: StepRequest,
    /// Length of this step, and of a full one [s].
    pub h: f64,
    full_length: f64,
    /// -dh/dt for the time t of the start, as in `StepRecord`.
    share: f64,
    /// Forces of the previous step, if contacts and torques have not changed since.
    pub previous: Option<MeanForces>,
    /// Guards of the ends of the soles at the start, and the contacts for which they were made.
    guards: Guards,
    guarded: (SoleContact, SoleContact),
    /// Sole points at the start of the present attempt.
    sole_points: SolePoints,
    /// Ends on the ice before the step opened some of them.
    closed: (SoleContact, SoleContact),
    /// Number of full steps requested from the start and after changes of contacts there.
    attempts: u32,
    trial: Trial,
}

/// Purpose of the present request.
#[derive(Debug, Clone, Copy)]
enum Trial {
    /// The full step.
    Full,
    /// Locate a landing.
    Landing(Landing),
    /// The full step again, without the landing found in it.
    FullWithoutLanding,
    /// Locate a release of an end, given its mean load over the full step.
    Release {
        which: (usize, End),
        full: MeanLoad,
        trials_left: usize,
    },
}

/// Result of a trial.
#[derive(Debug, Clone, Copy)]
pub(super) enum Progress {
    /// Another trial is requested.
    Requested,
    /// The step is complete. A landing or a release has ended it early.
    Done(Option<Guard>),
}

impl TrialSteps {
    /// No step.
    pub fn new(sim: &Simulation) -> Self {
        let touches = touches(sim.state.mode);
        Self {
            request: StepRequest {
                start: sim.state,
                centre: sim.sole_points.centre,
                h: 0.0,
                constraint: ModeConstraint {
                    near: sim.state.mode,
                    fixed: false,
                },
            },
            h: 0.0,
            full_length: 0.0,
            share: 0.0,
            previous: None,
            guards: Guards::of_ends(&sim.model, touches),
            guarded: touches,
            sole_points: sim.sole_points,
            closed: touches,
            attempts: 0,
            trial: Trial::Full,
        }
    }

    /// Begin a step of length `h` with the given `share` from the present state; a full one has `full_length` [s].
    pub fn begin_step(
        &mut self,
        sim: &mut Simulation,
        h: f64,
        share: f64,
        full_length: f64,
    ) -> Result<(), Termination> {
        self.request.constraint = ModeConstraint {
            near: sim.state.mode,
            fixed: false,
        };
        if sim.model.contact.is_push_only {
            sim.close_ends(h)?;
        }
        self.closed = touches(sim.state.mode);
        (self.h, self.share, self.full_length) = (h, share, full_length);
        self.attempts = 1;
        self.request_full(sim);
        Ok(())
    }

    /// Begin the step again from the present state, whose contacts have just changed. They may require a shorter
    /// step.
    fn restart(&mut self, sim: &mut Simulation) -> Progress {
        let (longest, sample) = (
            sim.longest_step(self.full_length),
            sim.time_to_noticed_sample(),
        );
        if longest.min(sample) < self.h {
            self.h = longest.min(sample);
            self.share = f64::from(u8::from(sample <= longest));
        }
        self.previous = None;
        self.attempts += 1;
        self.request_full(sim)
    }

    /// Request a quarter of the step from its start. False where that is too short.
    pub fn shorten(&mut self, sim: &mut Simulation) -> bool {
        if self.h <= SHORTEST {
            return false;
        }
        (self.h, self.share) = (0.25 * self.h, 0.0);
        sim.state = self.request.start;
        sim.sole_points = self.sole_points;
        self.request_full(sim);
        true
    }

    /// Request the full step from the present state.
    fn request_full(&mut self, sim: &mut Simulation) -> Progress {
        (self.request.start, self.request.centre) = (sim.state, sim.sole_points.centre);
        (self.request.h, self.trial) = (self.h, Trial::Full);
        self.sole_points = sim.sole_points;
        Progress::Requested
    }

    /// Request a shorter step, or the full step with another purpose.
    fn request_trial(&mut self, h: f64, trial: Trial) -> Progress {
        (self.request.h, self.trial) = (h, trial);
        Progress::Requested
    }

    /// Whether the contact problem of the requested step is needed. A release at the start reads it.
    pub fn needs_contact_problem(&self) -> bool {
        matches!(self.trial, Trial::Release { .. })
    }

    /// Continue after the requested step, which has ended in the contact mode `mode`. If other ends touch the ice than
    /// at its start, the step is void and the simulation unchanged.
    pub fn process(
        &mut self,
        sim: &mut Simulation,
        mode: ContactMode,
    ) -> Result<Progress, Termination> {
        match self.trial {
            Trial::Full => self.process_full(sim, mode),
            Trial::Landing(landing) => self.process_landing(sim, landing),
            Trial::FullWithoutLanding => self.process_without_landing(sim),
            Trial::Release {
                which,
                full,
                trials_left,
            } => self.process_release(sim, which, full, trials_left),
        }
    }

    fn process_full(
        &mut self,
        sim: &mut Simulation,
        mode: ContactMode,
    ) -> Result<Progress, Termination> {
        let before = touches(self.request.start.mode);
        if touches(mode) != before {
            // The impulses open a contact. The next attempt keeps the new mode, so this happens once per step.
            self.closed = before;
            sim.state = self.request.start;
            sim.apply_event(&self.request.start, |handler| {
                handler.open_ends(mode);
                Ok(())
            })?;
            // A free foot that alone is on the ice is now the supporting one.
            let near = match touches(mode) {
                (SoleContact::Air, touch) if touch != SoleContact::Air => ContactMode {
                    support: mode.free,
                    free: Foot::AIR,
                },
                _ => mode,
            };
            self.request.constraint = ModeConstraint { near, fixed: true };
            return Ok(self.restart(sim));
        }
        if before != self.guarded {
            self.guarded = before;
            self.guards = Guards::of_ends(&sim.model, before);
        }
        // A landing changes the forces, so a release is searched for in the step up to the landing.
        let Some(first) = self.first_landing(sim, None) else {
            return self.release_or_finish(sim, None);
        };
        let landing = self.landing_within(sim, first, self.h, MAX_LANDING_TRIALS);
        self.locate_landing(sim, landing)
    }

    /// Complete the step; `event` has ended it early.
    fn finish(&self, sim: &mut Simulation, event: Option<Guard>) -> Result<Progress, Termination> {
        let start = &self.request.start;
        let share = match event {
            Some(_) => 0.0,
            None => self.share,
        };
        sim.observe_time_step(start, (self.request.h, share), event);
        let (forces, sole_points) = (&sim.eval.solution, &sim.sole_points);
        sim.monitor
            .accumulate(&sim.model, forces, sole_points, start, &sim.state);
        sim.record_mode_change(start)?;
        Ok(Progress::Done(event))
    }
}
