//! Construction, reset, and the contact mode of a start.

use crate::{
    contact::equations::Slip,
    error::{Invalid, Termination},
    events::guards::{Guards, MAX_GUARDS},
    integrate::TimeStep,
    model::{
        Model,
        contact_mode::{ContactMode, FREE, Foot, SUPPORT, SoleContact},
        controller_state::ControllerState,
        friction::FrictionMode,
        layout::NV,
        state::{EnergyBalance, State, check_finite},
    },
    rhs::{Evaluation, jacobian::Implicit, sole_points::SolePoints},
    scene::Leg,
    sim::{
        Budget, NY, Observed, Simulation, Stats, gait_statistics::GaitMonitor,
        guard_samples::GuardSamples, initial_contacts::InitialContacts, log::BoundedLog,
        mode_system, trial::Evaluated,
    },
};
use std::sync::Arc;

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

    /// Reset to t = 0 at `Coordinates`: y0 and z0 are those of the supporting foot's toe. The state of a motion becomes the
    /// state bit for bit. A state that is rounded to single precision is projected onto the ice, by less than a micrometre.
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
        self.check_rotation()?;
        self.evaluate_start();
        let contacts = self.initial_contacts()?;
        let [support, free] = contacts.closed;
        if support == SoleContact::Heel {
            self.state.mode.support.touch = support;
            let at = self.at_pivot(&self.state.q, &self.state.v);
            (self.state.q, self.state.v) = (at.q, at.v);
            self.evaluate_start();
        }
        // Rounding moves only a heel: zero stays zero.
        let rest = match support {
            SoleContact::Heel => contacts.rest[SUPPORT],
            _ => 0.0,
        };
        let friction = &self.model.friction;
        let along = self.state.v[0];
        if friction.sticks() && support != SoleContact::Air && along.abs() > rest {
            return Err(Invalid(format!(
                "the supporting foot starts at {along} m/s; on sticking ice its speed must be 0"
            )));
        }
        let point = free.contact_point() as usize;
        let [free_along, _] = self.sole_points.speeds[FREE][point];
        let modes = [
            friction.mode_at(along, rest),
            friction.mode_at(free_along, contacts.rest[FREE]),
        ];
        let mode = |touches: [SoleContact; 2], free: FrictionMode| ContactMode {
            support: Foot::new(touches[SUPPORT], modes[SUPPORT]),
            free: Foot::new(touches[FREE], free),
        };
        let mut done = Ok(());
        if !contacts.is_impact && (contacts.is_off || contacts.is_moving) {
            let [touching, closed] =
                [contacts.touching, contacts.closed].map(|touches| mode(touches, modes[FREE]));
            done = self.project_start(&contacts, touching, closed);
        }
        self.state.energy_balance = EnergyBalance::default();
        if self.model.scene.energy_balance {
            self.state.energy_balance.start = self.energy_of(&self.eval);
        }
        self.state.mode.support.friction_mode = modes[SUPPORT];
        let mut handler = self.event_handler();
        let done = done.and_then(|()| match contacts.is_impact {
            true => {
                let closed = mode(contacts.closed, FrictionMode::Forward);
                handler.close_contacts(closed, closed)
            }
            false => {
                let moving = modes.map(|mode| (mode != FrictionMode::Stuck).then_some(mode));
                handler.select_mode(mode(contacts.closed, modes[FREE]), moving, None)
            }
        });
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

    /// Move the ends of `touching` onto the ice, and stop those of `closed`.
    fn project_start(
        &mut self,
        contacts: &InitialContacts,
        touching: ContactMode,
        closed: ContactMode,
    ) -> Result<(), Termination> {
        let mut handler = self.event_handler();
        if contacts.is_off {
            handler.close_gaps(touching)?;
        }
        if contacts.is_moving {
            handler.apply_impact_with(closed, Slip::default())?;
        }
        self.evaluate_start();
        Ok(())
    }

    /// Kinematics and sole points of the start.
    fn evaluate_start(&mut self) {
        let State { q, v, mode, .. } = &self.state;
        self.eval
            .set_configuration(&self.model, mode.support.touch, q, v);
        self.sole_points = SolePoints::of_one(&self.model, &self.eval.kin, *mode, q[1]);
    }

    /// Check that a foot that cannot rotate does not.
    fn check_rotation(&self) -> Result<(), Invalid> {
        let State { q, v, .. } = &self.state;
        if !self.model.contact.support_rotates && (q[2], v[2]) != (0.0, 0.0) {
            return Err(Invalid(format!(
                "q1 starts at {} rad and {} rad/s; without contact.foot_rotation both must be 0",
                q[2], v[2]
            )));
        }
        Ok(())
    }
}

/// State at t = 0 at the coordinates of the toe, before its contact mode is known.
fn state_at_start(q: [f64; NV], v: [f64; NV], leg: Leg) -> State {
    State {
        t: 0.0,
        q,
        v,
        mode: ContactMode {
            support: Foot::new(SoleContact::Toe, FrictionMode::Stuck),
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
