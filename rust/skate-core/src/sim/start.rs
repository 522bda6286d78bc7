//! Construction, reset, and the contact mode of a start.

use crate::{
    error::Invalid,
    events::guards::{Guards, MAX_GUARDS},
    integrate::TimeStep,
    model::{
        Model,
        contact_mode::{ContactMode, Foot, SoleContact},
        controller_state::ControllerState,
        friction::FrictionMode,
        layout::NV,
        state::{EnergyBalance, State, check_finite},
    },
    rhs::{Evaluation, jacobian::Implicit, sole_points::SolePoints},
    scene::Leg,
    sim::{
        Budget, NY, Observed, Simulation, Stats, gait_statistics::GaitMonitor,
        guard_samples::GuardSamples, log::BoundedLog, mode_system, trial::Evaluated,
    },
};
use std::sync::Arc;

/// Tolerated penetration of a foot at the start [m].
const START_DEPTH: f64 = 1e-9;

impl Simulation {
    /// A simulation at the scene's start.
    ///
    /// # Errors
    /// `Invalid` if the start is not valid; see `reset`.
    pub fn new(model: impl Into<Arc<Model>>) -> Result<Self, Invalid> {
        let model = model.into();
        let start = &model.scene.start;
        let (q, v) = (model.from_names(&start.q), model.from_names(&start.v));
        let state = state_at_start(q, v, start.support_leg);
        let mut sim = Self {
            monitor: GaitMonitor::new(&state, &SolePoints::default()),
            sole_points: SolePoints::default(),
            guards: Guards::of(&model, state.mode),
            values: [0.0; MAX_GUARDS],
            dy: [0.0; NY],
            step: TimeStep::new(
                &mode_system::sizes(&model),
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
            observer: Observed::default(),
            model,
            state,
            eval: Evaluation::default(),
            evaluated: Evaluated::Elsewhere,
        };
        sim.reset_in_place(&q, &v, state.support_leg)?;
        Ok(sim)
    }

    /// Reset to t = 0 at a state whose supporting foot is flat or on an edge.
    ///
    /// # Errors
    /// `Invalid`, and nothing has changed, if a number is not finite or a foot is below the ice.
    pub fn reset(&mut self, q: &[f64; NV], v: &[f64; NV], leg: Leg) -> Result<(), Invalid> {
        let mut draft = self.draft();
        draft.reset_in_place(q, v, leg)?;
        self.replace(draft);
        Ok(())
    }

    /// `reset` without a draft.
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
        self.values = [0.0; MAX_GUARDS];
        self.dy = [0.0; NY];
        self.eval.count = 0;
        self.implicit.count = 0;
        self.state = state_at_start(q, v, leg);
        self.observe_beginning();
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
            self.step = TimeStep::new(
                &mode_system::sizes(&model),
                &mode_system::error_groups(&model),
            );
        }
        self.model = model;
        Ok(())
    }

    /// Set the contact mode of the start: the ends of the soles on the ice, and their friction modes.
    fn initial_mode(&mut self) -> Result<(), Invalid> {
        let (q, v) = (self.state.q, self.state.v);
        let touch = self.state.mode.support.touch;
        self.eval.set_configuration(&self.model, touch, &q, &v);
        self.sole_points = SolePoints::of_one(&self.model, &self.eval.kin, self.state.mode, q[1]);
        let [support, free] = self.initial_contacts()?;
        self.check_root_constraints()?;
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

    /// Contacts of the supporting and the free foot at the start.
    fn initial_contacts(&self) -> Result<[SoleContact; 2], Invalid> {
        let gaps = self.sole_points.gaps;
        let contact = self.model.contact;
        let push_only = contact.is_push_only;
        let names = [
            ["supporting heel", "supporting toe"],
            ["free heel", "free toe"],
        ];
        for foot in 0..2 {
            for end in 0..2 {
                let counts = match (foot, end) {
                    (0, _) => true,
                    (_, 0) => contact.free_foot_touches,
                    _ => contact.free_toe_touches_alone,
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
            _ if !contact.free_foot_touches => SoleContact::Air,
            SoleContact::Flat => free,
            _ if push_only => free,
            _ => SoleContact::Air,
        };
        if support == SoleContact::Air && !push_only {
            return Err(Invalid("the supporting foot starts above the ice".into()));
        }
        Ok([support, free])
    }

    /// Check that the root's state satisfies the constraints that the scene imposes in every contact mode.
    fn check_root_constraints(&self) -> Result<(), Invalid> {
        let State { q, v, .. } = &self.state;
        if !self.model.contact.support_rotates && (q[2], v[2]) != (0.0, 0.0) {
            return Err(Invalid(format!(
                "q1 starts at {} rad and {} rad/s; without contact.foot_rotation both must be 0",
                q[2], v[2]
            )));
        }
        if self.model.friction.sticks() && v[0] != 0.0 {
            return Err(Invalid(format!(
                "the supporting foot starts at {} m/s; on sticking ice its speed must be 0",
                v[0]
            )));
        }
        Ok(())
    }
}

/// State at t = 0 with the supporting foot on the lower end of its sole and the free foot in the air, before its contact
/// mode is known.
fn state_at_start(q: [f64; NV], v: [f64; NV], leg: Leg) -> State {
    let touch = if q[2] > 0.0 {
        SoleContact::Heel
    } else {
        SoleContact::Toe
    };
    State {
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
        is_stiff: false,
    }
}
