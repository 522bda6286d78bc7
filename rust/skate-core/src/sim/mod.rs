//! Event-driven simulation: time step, event detection, event handling.

mod advance;
mod budget;
mod event_location;
pub mod gait_statistics;
mod guard_samples;
mod hybrid;
mod kick;
mod log;
mod mode_system;
mod moreau;
mod rollback;
pub mod snapshot;
mod step;

use crate::{
    control::{self, ControllerInput, sample, sampled},
    dynamics::bias_forces::energy,
    error::{Invalid, Termination},
    events::{
        EventHandler,
        guards::{Guards, MOST},
    },
    integrate::Step,
    model::{
        Model,
        contact_mode::{ContactMode, Foot, SoleContact},
        controller_state::ControllerState,
        friction::FrictionMode,
        layout::{NV, ROOT},
        state::{EnergyBalance, State, check_finite},
    },
    rhs::{Evaluation, jacobian::Implicit, sole_points::SolePoints},
    scene::{Leg, Way},
    sim::gait_statistics::{GaitMonitor, StepRecord, Totals},
};
pub use advance::advance_many;
pub(crate) use advance::step_many;
pub(crate) use budget::Budget;
pub use budget::most_evaluations;
use guard_samples::GuardSamples;
pub(crate) use kick::check_kick;
use log::BoundedLog;
pub use log::LOG_CAPACITY;
pub use moreau::HasSimulation;
pub(crate) use moreau::MAX_BATCH;
pub(crate) use rollback::RollbackState;
use serde::{Deserialize, Serialize};
use std::sync::Arc;

/// Maximum size of the integrated vector: q, v and three powers.
pub(crate) const NY: usize = 2 * NV + 3;
/// Tolerated penetration of a foot at the start [m].
const START_DEPTH: f64 = 1e-9;

/// Counters since the start.
#[derive(Debug, Clone, Copy, Default, PartialEq, Serialize, Deserialize)]
pub struct Stats {
    pub steps: u64,
    pub rejections: u64,
    pub evaluations: u64,
    pub events: u64,
    pub root_iterations: u64,
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
    pub t: f64,
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
    /// Sole points at `state`.
    pub sole_points: SolePoints,
    pub stats: Stats,
    pub ended: Option<Termination>,
    pub(crate) monitor: GaitMonitor,
    guards: Guards,
    /// Guard values at `state`.
    pub(crate) values: [f64; MOST],
    pub(crate) dy: [f64; NY],
    step: Step<NY>,
    pub(crate) implicit: Implicit,
    guard_samples: GuardSamples,
    pub(crate) residual: [f64; NV],
    /// Averaging time of the contact forces: the last time step [s]; 0 if they are instantaneous.
    pub(crate) averaging_time: f64,
    /// The residual torque has jumped since the last time step.
    pub(crate) torque_jumped: bool,
    pub(crate) budget: Budget,
    events: BoundedLog<Event>,
    records: BoundedLog<StepRecord>,
}

/// Threshold for a jump of a torque [N m].
const JUMP: f64 = 1.0;

impl Simulation {
    /// A simulation at the scene's start.
    ///
    /// # Errors
    /// `Invalid` if the start is not valid; see `reset`.
    pub fn new(model: impl Into<Arc<Model>>) -> Result<Self, Invalid> {
        let model = model.into();
        let start = &model.scene.start;
        let (q, v) = (model.from_names(&start.q), model.from_names(&start.v));
        let state = State {
            t: 0.0,
            q,
            v,
            mode: ContactMode {
                support: Foot::AIR,
                free: Foot::AIR,
            },
            support_leg: start.support_leg,
            controller: Default::default(),
            anchor: 0.0,
            energy_balance: EnergyBalance::default(),
            h: 1e-4,
        };
        let mut sim = Self {
            monitor: GaitMonitor::new(&state, &SolePoints::default()),
            sole_points: SolePoints::default(),
            guards: Guards::of(&model, state.mode),
            values: [0.0; MOST],
            dy: [0.0; NY],
            step: Step::new(
                &mode_system::scales(&model),
                &mode_system::error_groups(&model),
            ),
            implicit: Implicit::default(),
            guard_samples: GuardSamples::none(Guards::of(&model, state.mode)),
            residual: [0.0; NV],
            averaging_time: 0.0,
            torque_jumped: false,
            budget: Budget::default(),
            events: BoundedLog::new(),
            records: BoundedLog::new(),
            stats: Stats::default(),
            ended: None,
            model,
            state,
            eval: Evaluation::default(),
        };
        sim.reset_in_place(&q, &v, state.support_leg)?;
        Ok(sim)
    }

    /// Reset to t = 0 at a state whose supporting foot is flat or on an edge.
    ///
    /// # Errors
    /// `Invalid`, and nothing has changed, if a number is not finite or a foot is below the ice.
    pub fn reset(&mut self, q: &[f64; NV], v: &[f64; NV], leg: Leg) -> Result<(), Invalid> {
        let saved = self.begin_tentative_reset();
        let done = self.reset_in_place(q, v, leg);
        match done {
            Ok(()) => self.commit_reset(),
            Err(_) => self.roll_back(saved),
        }
        done
    }

    /// `reset` without rollback.
    ///
    /// # Errors
    /// `Invalid`; the previous state is lost.
    pub(crate) fn reset_in_place(
        &mut self,
        q: &[f64; NV],
        v: &[f64; NV],
        leg: Leg,
    ) -> Result<(), Invalid> {
        let n = self.model.n;
        check_finite("q", &q[..n])?;
        check_finite("v", &v[..n])?;
        // Flush subnormals so that all CPUs classify contacts alike.
        let [q, v] = [q, v].map(|x| x.map(|x| if x.is_subnormal() { 0.0 } else { x }));
        self.stats = Stats::default();
        self.events.clear();
        self.records.clear();
        self.ended = None;
        self.budget = Budget::default();
        self.residual = [0.0; NV];
        self.torque_jumped = false;
        // Unused guard values are part of a snapshot and must not depend on the previous mode.
        self.values = [0.0; MOST];
        self.dy = [0.0; NY];
        self.eval.count = 0;
        self.implicit.count = 0;
        let touch = if q[2] > 0.0 {
            SoleContact::Heel
        } else {
            SoleContact::Toe
        };
        self.state = State {
            t: 0.0,
            q,
            v,
            mode: ContactMode {
                support: Foot::new(touch, FrictionMode::Stuck),
                free: Foot::AIR,
            },
            support_leg: leg,
            controller: ControllerState {
                leg,
                ..ControllerState::default()
            },
            anchor: 0.0,
            energy_balance: EnergyBalance::default(),
            h: 1e-4,
        };
        self.initial_mode()?;
        self.update_counters();
        Ok(())
    }

    /// Replace the model by one with other parameters of the same scene, before a reset.
    ///
    /// # Errors
    /// `Invalid`, and nothing has changed, if the coordinates differ.
    pub fn set_model(&mut self, model: impl Into<Arc<Model>>) -> Result<(), Invalid> {
        let model = model.into();
        if model.names != self.model.names {
            let (old, new) = (self.model.names.join(" "), model.names.join(" "));
            return Err(Invalid(format!(
                "the model has the coordinates {new} instead of {old}"
            )));
        }
        if model.scene.energy_balance != self.model.scene.energy_balance {
            self.step = Step::new(
                &mode_system::scales(&model),
                &mode_system::error_groups(&model),
            );
        }
        self.model = model;
        Ok(())
    }

    /// Contact mode of the start: which ends of the soles are on the ice, and their friction modes.
    fn initial_mode(&mut self) -> Result<(), Invalid> {
        let (q, v) = (self.state.q, self.state.v);
        let touch = self.state.mode.support.touch;
        self.eval.set_configuration(&self.model, touch, &q, &v);
        self.sole_points = SolePoints::of_one(&self.model, &self.eval.kin, self.state.mode, q[1]);
        let gaps = self.sole_points.gaps;
        let contact = self.model.contact;
        let push_only = contact.is_unilateral();
        let names = [
            ["supporting heel", "supporting toe"],
            ["free heel", "free toe"],
        ];
        for foot in 0..2 {
            for end in 0..2 {
                let counts = match (foot, end) {
                    (0, _) => true,
                    (_, 0) => contact.free_foot_touches(),
                    _ => contact.free_toe_touches_alone(),
                };
                if counts && gaps[foot][end] < -START_DEPTH {
                    return Err(Invalid(format!(
                        "the {} starts {} m below the ice; its height must be at least 0",
                        names[foot][end], -gaps[foot][end]
                    )));
                }
            }
        }
        let [support, free] =
            gaps.map(|[heel, toe]| SoleContact::of(heel <= START_DEPTH, toe <= START_DEPTH));
        let free = match free {
            _ if !contact.free_foot_touches() => SoleContact::Air,
            SoleContact::Flat => free,
            _ if push_only => free,
            _ => SoleContact::Air,
        };
        if support == SoleContact::Air && !push_only {
            return Err(Invalid("the supporting foot starts above the ice".into()));
        }
        if !contact.support_rotates() && (q[2], v[2]) != (0.0, 0.0) {
            return Err(Invalid(format!(
                "q1 starts at {} rad and {} rad/s; without contact.foot_rotation both must be 0",
                q[2], v[2]
            )));
        }
        let friction = &self.model.friction;
        if friction.sticks() && v[0] != 0.0 {
            return Err(Invalid(format!(
                "the supporting foot starts at {} m/s; on sticking ice its speed must be 0",
                v[0]
            )));
        }
        if self.model.scene.energy_balance {
            self.state.energy_balance.start = self.energy_of(&self.eval);
        }
        let friction_mode = self.model.friction.mode_at(v[0], 0.0);
        let guess = ContactMode {
            support: Foot::new(support, friction_mode),
            free: Foot::new(free, FrictionMode::Forward),
        };
        self.state.mode.support.friction_mode = friction_mode;
        // Without an approaching contact there is no impact.
        let flat = support == SoleContact::Flat;
        let no_impact = free == SoleContact::Air && v[1] == 0.0 && !(flat && v[2] != 0.0);
        let mut handler = self.event_handler();
        let done = if no_impact {
            let moving = (friction_mode != FrictionMode::Stuck).then_some(friction_mode);
            handler.select_mode(guess, [moving, None], None)
        } else {
            handler.close_contacts(guess)
        };
        done.map_err(|cause| {
            Invalid(format!(
                "no motion is possible from this start: {}",
                cause.name()
            ))
        })?;
        self.sample();
        self.ended = self.resume().err();
        self.monitor = GaitMonitor::new(&self.state, &self.sole_points);
        self.update_counters();
        Ok(())
    }

    /// Sample the controller.
    fn sample(&mut self) {
        let state = &mut self.state;
        let now = (state.t, state.support_leg, state.mode);
        let angle = state.free_foot_angle();
        sample(&self.model, now, angle, &mut state.controller);
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
        )
    }

    /// Set the residual joint torques (n - 3 entries, without the root), held constant until the next call
    /// [N m].
    pub fn hold(&mut self, torque: &[f64]) {
        let joints = &mut self.residual[ROOT..self.model.n];
        if joints == torque || self.ended.is_some() {
            return;
        }
        let jump = |(old, new): (&f64, &f64)| (new - old).abs() > JUMP;
        let jumps = joints.iter().zip(torque).any(jump);
        joints.copy_from_slice(torque);
        self.budget.add_call();
        if let Way::TimeSteps { .. } = self.model.scene.accuracy.way() {
            if jumps {
                (self.averaging_time, self.torque_jumped) = (0.0, true);
            }
            return;
        }
        let resumed = self.resume();
        self.ended = resumed.err();
        self.update_counters();
    }

    /// Torques of the baseline controller at the present state [N m].
    pub fn baseline(&self) -> [f64; NV] {
        let State { q, v, mode, .. } = &self.state;
        let mut eval = self.eval.clone();
        eval.set_configuration(&self.model, mode.support.touch, q, v);
        control::baseline(
            &self.model,
            &mut eval.kin,
            v,
            q,
            &ControllerInput::of(&self.state),
        )
    }

    /// Position of the top of the head in the world [m].
    pub fn head(&self) -> [f64; 3] {
        let [x, y, z] = self.sole_points.head;
        [x, y + self.state.q[0], z + self.state.q[1]]
    }

    /// Totals since the start or the last `reset_totals`.
    pub fn totals(&self) -> &Totals {
        &self.monitor.totals
    }

    /// Restart the totals at the present state.
    pub fn reset_totals(&mut self) {
        self.monitor.totals = Totals::new(&self.state);
    }

    /// Time since the last change of the contact mode or the supporting leg [s].
    pub fn since_event(&self) -> f64 {
        self.state.t - self.monitor.changed
    }

    /// End of the present action period [s]; periods are counted from t = 0.
    pub fn next_action_time(&self) -> f64 {
        let period = self.model.scene.control.action_period;
        ((self.state.t / period).round() + 1.0) * period
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

    /// Evaluation with the kinematics of all bodies at the present state, for energy, momentum and drawing.
    /// A time step does not compute the arms in world axes.
    pub fn full_kinematics(&self) -> Evaluation {
        let mut eval = self.eval.clone();
        let State { q, v, mode, .. } = &self.state;
        eval.full_kinematics(&self.model, mode.support.touch, q, v);
        eval
    }

    /// Kinetic plus potential energy [J]; the ice is the zero of height.
    pub fn energy(&self) -> f64 {
        self.energy_of(&self.full_kinematics())
    }

    /// The same for an evaluation with full kinematics.
    fn energy_of(&self, eval: &Evaluation) -> f64 {
        let State { q, v, .. } = &self.state;
        let (kinetic, potential) = energy(&self.model, &eval.kin, v, q[1]);
        kinetic + potential
    }

    /// Error of the energy balance: unaccounted energy [J]; 0 if the scene has no energy balance.
    pub fn energy_residual(&self) -> f64 {
        if !self.model.scene.energy_balance {
            return 0.0;
        }
        self.energy() - self.state.energy_balance.total()
    }

    /// Events since the last call, at most the last `LOG_CAPACITY`.
    pub fn take_events(&mut self) -> Vec<Event> {
        self.events.take()
    }

    /// Gait steps completed since the last call, at most the last `LOG_CAPACITY`.
    pub fn take_records(&mut self) -> Vec<StepRecord> {
        self.records.take()
    }
}
