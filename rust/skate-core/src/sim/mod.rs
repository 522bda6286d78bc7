//! The loop: step, look for events, pass them.

mod advance;
mod budget;
mod event_location;
pub mod gait_statistics;
mod hybrid;
mod kick;
mod log;
mod mode_system;
mod moreau;
mod rollback;
pub mod snapshot;
mod stage_guards;
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
        contact_mode::{ContactMode, Foot, FrictionMode, SoleContact},
        controller_state::ControllerState,
        layout::{NV, ROOT},
        state::{EnergyBalance, State, check_finite},
    },
    rhs::{Evaluation, jacobian::Implicit, sole_points::SolePoints},
    scene::{Leg, Way},
    sim::gait_statistics::{Monitor, StepRecord, Totals},
};
pub use advance::advance_many;
pub(crate) use advance::step_many;
pub(crate) use budget::Budget;
pub use budget::most_evaluations;
pub(crate) use kick::check_kick;
pub use log::KEPT;
use log::Log;
pub use moreau::HasSimulation;
pub(crate) use moreau::TOGETHER;
pub(crate) use rollback::Rollback;
use serde::{Deserialize, Serialize};
use stage_guards::StageGuards;
use std::sync::Arc;

/// Most components of the integrated vector: q and v, as many as the model has, and three powers.
pub(crate) const NY: usize = 2 * NV + 3;
/// How deep a foot may start below the ice [m].
const START_DEPTH: f64 = 1e-9;

/// Counts since the start.
#[derive(Debug, Clone, Copy, Default, PartialEq, Serialize, Deserialize)]
pub struct Stats {
    pub steps: u64,
    pub rejections: u64,
    pub evaluations: u64,
    pub events: u64,
    pub root_iterations: u64,
    pub projections: u64,
    /// Of M + g D, by the implicit methods.
    pub factorisations: u64,
    /// Sum of the local errors that the method estimates, root mean square of all coordinates [rad, m];
    /// 0 where steps are fixed.
    pub error_estimate: f64,
}

/// Something that happened.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Event {
    pub t: f64,
    pub what: &'static str,
    /// Modes before and after.
    pub from: ContactMode,
    pub to: ContactMode,
    /// Supporting leg afterwards.
    pub leg: Leg,
}

/// One robot on one sheet of ice.
#[derive(Debug, Clone)]
pub struct Simulation {
    /// Shared by all that have the same numbers.
    pub model: Arc<Model>,
    pub state: State,
    /// Evaluated at `state`; after time steps it knows no more than the forces.
    pub eval: Evaluation,
    /// Of `state`.
    pub sole_points: SolePoints,
    pub stats: Stats,
    pub ended: Option<Termination>,
    pub(crate) monitor: Monitor,
    guards: Guards,
    /// Guard values at `state`.
    pub(crate) values: [f64; MOST],
    pub(crate) dy: [f64; NY],
    step: Step<NY>,
    pub(crate) implicit: Implicit,
    stage_guards: StageGuards,
    pub(crate) residual: [f64; NV],
    /// Length of the time step over which contact forces are means [s]; 0 where they are of the present.
    pub(crate) averaged: f64,
    /// Torques have jumped since the last one.
    pub(crate) jumped: bool,
    pub(crate) budget: Budget,
    events: Log<Event>,
    records: Log<StepRecord>,
}

/// A torque that changes by more jumps [N m].
const JUMP: f64 = 1.0;

impl Simulation {
    /// A simulation at the scene's start.
    ///
    /// # Errors
    /// `Invalid` where the start is not one: see `reset`.
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
            monitor: Monitor::new(&state, &SolePoints::default()),
            sole_points: SolePoints::default(),
            guards: Guards::of(&model, state.mode),
            values: [0.0; MOST],
            dy: [0.0; NY],
            step: Step::new(&mode_system::scales(&model), &mode_system::parts(&model)),
            implicit: Implicit::default(),
            stage_guards: StageGuards::none(Guards::of(&model, state.mode)),
            residual: [0.0; NV],
            averaged: 0.0,
            jumped: false,
            budget: Budget::default(),
            events: Log::new(),
            records: Log::new(),
            stats: Stats::default(),
            ended: None,
            model,
            state,
            eval: Evaluation::default(),
        };
        sim.begin(&q, &v, state.support_leg)?;
        Ok(sim)
    }

    /// Start anew at t = 0 from a state whose supporting foot stands flat or on an edge.
    ///
    /// # Errors
    /// `Invalid`, and nothing has changed, where a number is not finite or a foot is below the ice.
    pub fn reset(&mut self, q: &[f64; NV], v: &[f64; NV], leg: Leg) -> Result<(), Invalid> {
        let past = self.save_for_rollback();
        let begun = self.begin(q, v, leg);
        match begun {
            Ok(()) => self.forget(),
            Err(_) => self.roll_back(past),
        }
        begun
    }

    /// The same in place.
    ///
    /// # Errors
    /// `Invalid`, and what was is lost.
    pub(crate) fn begin(&mut self, q: &[f64; NV], v: &[f64; NV], leg: Leg) -> Result<(), Invalid> {
        let n = self.model.n;
        check_finite("q", &q[..n])?;
        check_finite("v", &v[..n])?;
        // Whether a foot slides or stands on its heel is not to hang on numbers that some processors, told
        // so, take for zero.
        let [q, v] = [q, v].map(|x| x.map(|x| if x.is_subnormal() { 0.0 } else { x }));
        self.stats = Stats::default();
        self.events.clear();
        self.records.clear();
        self.ended = None;
        self.budget = Budget::default();
        self.residual = [0.0; NV];
        self.jumped = false;
        // The present mode may have fewer guards than the last: what follows them goes into snapshots, too.
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
        self.first_mode()?;
        self.update_counters();
        Ok(())
    }

    /// Take over other numbers of the same scene, before a reset.
    ///
    /// # Errors
    /// `Invalid`, and nothing has changed, where the models do not have the same coordinates.
    pub fn exchange(&mut self, model: impl Into<Arc<Model>>) -> Result<(), Invalid> {
        let model = model.into();
        if model.names != self.model.names {
            let (old, new) = (self.model.names.join(" "), model.names.join(" "));
            return Err(Invalid(format!("a model of {new} instead of {old}")));
        }
        if model.scene.energy_balance != self.model.scene.energy_balance {
            self.step = Step::new(&mode_system::scales(&model), &mode_system::parts(&model));
        }
        self.model = model;
        Ok(())
    }

    /// Which ends of the soles are on the ice at the start, and how they move.
    fn first_mode(&mut self) -> Result<(), Invalid> {
        let (q, v) = (self.state.q, self.state.v);
        let touch = self.state.mode.support.touch;
        self.eval.move_to(&self.model, touch, &q, &v);
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
        let near = ContactMode {
            support: Foot::new(support, friction_mode),
            free: Foot::new(free, FrictionMode::Forward),
        };
        self.state.mode.support.friction_mode = friction_mode;
        // Where nothing runs into the ice nothing needs to be stopped.
        let flat = support == SoleContact::Flat;
        let calm = free == SoleContact::Air && v[1] == 0.0 && !(flat && v[2] != 0.0);
        let mut passage = self.passage();
        let begun = if calm {
            let moving = (friction_mode != FrictionMode::Stuck).then_some(friction_mode);
            passage.choose(near, [moving, None], None)
        } else {
            passage.begin(near)
        };
        begun.map_err(|cause| {
            Invalid(format!(
                "no motion is possible from this start: {}",
                cause.name()
            ))
        })?;
        self.sample();
        self.ended = self.resume().err();
        self.monitor = Monitor::new(&self.state, &self.sole_points);
        self.update_counters();
        Ok(())
    }

    /// Let the controller look.
    fn sample(&mut self) {
        let state = &mut self.state;
        let now = (state.t, state.support_leg, state.mode);
        let angle = state.free_foot_angle();
        sample(&self.model, now, angle, &mut state.controller);
    }

    /// The clock if the controller looked now.
    fn sampled(&self) -> ControllerState {
        sampled(&self.model, &self.state, self.state.free_foot_angle())
    }

    fn passage(&mut self) -> EventHandler<'_> {
        EventHandler {
            model: &self.model,
            eval: &mut self.eval,
            state: &mut self.state,
            residual: &mut self.residual,
            entered: None,
            unfactored: None,
        }
    }

    /// Hold joint torques (n - 3 of them, without the root) from now on [N m].
    pub fn hold(&mut self, torque: &[f64]) {
        let joints = &mut self.residual[ROOT..self.model.n];
        if joints == torque || self.ended.is_some() {
            return;
        }
        let jump = |(old, new): (&f64, &f64)| (new - old).abs() > JUMP;
        let jumps = joints.iter().zip(torque).any(jump);
        joints.copy_from_slice(torque);
        self.budget.call();
        if let Way::TimeSteps { .. } = self.model.scene.accuracy.way() {
            if jumps {
                (self.averaged, self.jumped) = (0.0, true);
            }
            return;
        }
        let resumed = self.resume();
        self.ended = resumed.err();
        self.update_counters();
    }

    /// Torques of the controller alone at the present state [N m].
    pub fn baseline(&self) -> [f64; NV] {
        let State { q, v, mode, .. } = &self.state;
        let mut eval = self.eval.clone();
        eval.move_to(&self.model, mode.support.touch, q, v);
        control::baseline(
            &self.model,
            &mut eval.kin,
            v,
            q,
            &ControllerInput::of(&self.state),
        )
    }

    /// Top of the head in the world [m].
    pub fn head(&self) -> [f64; 3] {
        let [x, y, z] = self.sole_points.head;
        [x, y + self.state.q[0], z + self.state.q[1]]
    }

    /// What has come together since the start, or since `begin_totals`.
    pub fn totals(&self) -> &Totals {
        &self.monitor.totals
    }

    /// Count from the present state on.
    pub fn begin_totals(&mut self) {
        self.monitor.totals = Totals::begin(&self.state);
    }

    /// Time since the contact state or the supporting leg last changed [s].
    pub fn since_event(&self) -> f64 {
        self.state.t - self.monitor.changed
    }

    /// The end of the present action period; periods are counted from t = 0.
    pub fn next_action_time(&self) -> f64 {
        let period = self.model.scene.control.action_period;
        ((self.state.t / period).round() + 1.0) * period
    }

    /// Bring up to date what a snapshot keeps and observers see.
    pub(crate) fn update_counters(&mut self) {
        if self.ended.is_some() {
            // It may have ended halfway through an event.
            let State { q, v, mode, .. } = &self.state;
            self.eval.move_planar(&self.model, *mode, q, v);
            self.sole_points = SolePoints::of_one(&self.model, &self.eval.kin, *mode, q[1]);
        }
        self.stats.evaluations = self.eval.count;
        self.stats.factorisations = self.implicit.count;
    }

    /// An evaluation that knows all bodies at the present state, for energy, momentum and drawing: a
    /// step leaves the arms' place in the world out.
    pub fn full_kinematics(&self) -> Evaluation {
        let mut eval = self.eval.clone();
        let State { q, v, mode, .. } = &self.state;
        eval.full_kinematics(&self.model, mode.support.touch, q, v);
        eval
    }

    /// Kinetic and potential energy [J]; the ice is the zero of height.
    pub fn energy(&self) -> f64 {
        self.energy_of(&self.full_kinematics())
    }

    /// The same where `eval` knows the bodies' places and velocities.
    fn energy_of(&self, eval: &Evaluation) -> f64 {
        let State { q, v, .. } = &self.state;
        let (kinetic, potential) = energy(&self.model, &eval.kin, v, q[1]);
        kinetic + potential
    }

    /// Energy that nobody booked [J]: the error of the balance; 0 without a ledger.
    pub fn energy_residual(&self) -> f64 {
        if !self.model.scene.energy_balance {
            return 0.0;
        }
        self.energy() - self.state.energy_balance.total()
    }

    /// Events since the last call, the last `KEPT` of them.
    pub fn take_events(&mut self) -> Vec<Event> {
        self.events.take()
    }

    /// Steps completed since the last call, the last `KEPT` of them.
    pub fn take_records(&mut self) -> Vec<StepRecord> {
        self.records.take()
    }
}
