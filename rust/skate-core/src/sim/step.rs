//! One time step and the event that ends it.

use crate::{
    error::Termination,
    events::{
        guard::{FORCE_SLACK, Guard},
        guards::Guards,
    },
    integrate::{Method, System},
    model::{
        contact_mode::{ContactMode, SoleContact},
        layout::NV,
        state::is_bounded,
    },
    rhs::{StepContext, projection::project, sole_points::SolePoints},
    scene::Leg,
    sim::{
        Event, NY, Simulation, event_location::StepEvent, gait_statistics::MIN_STEP_PERIOD,
        mode_system::ModeSystem,
    },
};

/// Maximum and minimum time step [s].
const MAX_STEP: f64 = 0.1;
const MIN_STEP: f64 = 1e-12;

impl Simulation {
    /// Continue after a change of torques, which changes accelerations and forces and may trigger an event.
    pub(super) fn resume(&mut self) -> Result<(), Termination> {
        self.begin_mode()?;
        match self.immediate_guard() {
            Some(guard) => self.handle_event(guard),
            None => Ok(()),
        }
    }

    /// One accepted time step and the event that ends it, if any.
    pub(super) fn advance_once(&mut self, method: Method, until: f64) -> Result<(), Termination> {
        let (h, next_h) = self.attempt(method, until)?;
        let whole = self.state.t + h >= until;
        let (theta, event) = self.first_event(method)?;
        let before = self.state;
        if theta < 1.0 || event.is_some() {
            let y = self.step.at(theta);
            self.set_state(&y, before.t + theta * h);
            self.begin_mode()?;
        } else {
            let y = self.step.y1;
            self.set_state(&y, if whole { until } else { before.t + h });
            self.state.h = next_h;
            self.dy = *self.step.dy1();
            self.read_guards();
        }
        if project(&self.model, &mut self.eval, &mut self.state)? {
            self.stats.projections += 1;
            self.begin_mode()?;
        }
        self.count_step()?;
        let here = (&self.eval.solution, &self.sole_points);
        self.monitor
            .accumulate(&self.model, here, &before, &self.state);
        match event {
            Some(StepEvent::Guard(guard)) => self.handle_event(guard),
            Some(StepEvent::Sample) => {
                self.sample();
                self.resume()
            }
            None => Ok(()),
        }
    }

    /// Attempt time steps from the present state until the error is within tolerance. Returns the step size
    /// and the next one [s].
    fn attempt(&mut self, method: Method, until: f64) -> Result<(f64, f64), Termination> {
        let state = &self.state;
        let left = until - state.t;
        let mut h = method.step().unwrap_or(state.h.min(MAX_STEP));
        let y = self.integrated_vector();
        loop {
            let wanted = h;
            // Avoid a tiny last step.
            if method.step().is_some() {
                h = left / (left / h - 1e-9).ceil().max(1.0);
            } else if h > left * (1.0 - 1e-9) {
                h = left;
            } else if h > 0.5 * left {
                h = 0.5 * left;
            }
            self.guard_samples.start_step(self.guards, self.state.t, h);
            let mut system = ModeSystem {
                model: &self.model,
                eval: &mut self.eval,
                implicit: &mut self.implicit,
                guard_samples: &mut self.guard_samples,
                context: StepContext::of(&self.model, &self.state, &self.residual),
            };
            let start = (self.state.t, &y, &self.dy);
            let done = self.step.attempt(method, &mut system, start, h);
            let error = match done {
                Ok(()) => self.step.error(method),
                Err(_) => f64::INFINITY,
            };
            if error <= 1.0 {
                self.stats.error_estimate += error * method.tolerance().unwrap_or(0.0);
                let next = h * method.step_factor(error);
                return Ok((h, if h < wanted { next.max(wanted) } else { next }));
            }
            self.stats.rejections += 1;
            h *= if error.is_finite() {
                method.step_factor(error).min(0.9)
            } else {
                0.1
            };
            if method.is_implicit() {
                // The method takes its matrix from the last evaluation, which must be at the present state.
                self.begin_mode()?;
            }
            if h < MIN_STEP {
                return Err(done.err().unwrap_or(Termination::StepLimit));
            }
        }
    }

    /// Integrated vector at the present state: q, v, energies.
    fn integrated_vector(&self) -> [f64; NY] {
        let (n, state) = (self.model.n.min(NV), &self.state);
        let energy_balance = &state.energy_balance;
        let mut y = [0.0; NY];
        y[..n].copy_from_slice(&state.q[..n]);
        y[n..2 * n].copy_from_slice(&state.v[..n]);
        y[2 * n..2 * n + 3].copy_from_slice(&[
            energy_balance.actuators,
            energy_balance.damping,
            energy_balance.friction,
        ]);
        y
    }

    fn set_state(&mut self, y: &[f64; NY], t: f64) {
        let (n, state) = (self.model.n.min(NV), &mut self.state);
        state.t = t;
        state.q[..n].copy_from_slice(&y[..n]);
        state.v[..n].copy_from_slice(&y[n..2 * n]);
        let energy_balance = &mut state.energy_balance;
        [
            energy_balance.actuators,
            energy_balance.damping,
            energy_balance.friction,
        ] = [y[2 * n], y[2 * n + 1], y[2 * n + 2]];
    }

    /// Evaluate at the present state and update the guards.
    pub(crate) fn begin_mode(&mut self) -> Result<(), Termination> {
        let y = self.integrated_vector();
        self.guard_samples
            .start_step(self.guards, self.state.t, 0.0);
        let mut system = ModeSystem {
            model: &self.model,
            eval: &mut self.eval,
            implicit: &mut self.implicit,
            guard_samples: &mut self.guard_samples,
            context: StepContext::of(&self.model, &self.state, &self.residual),
        };
        system.rhs(self.state.t, &y, &mut self.dy)?;
        self.averaging_time = 0.0;
        self.guards = Guards::of(&self.model, self.state.mode);
        self.read_guards();
        Ok(())
    }

    fn read_guards(&mut self) {
        let at = (self.state.q[1], self.state.v[0]);
        self.sole_points = SolePoints::of_one(&self.model, &self.eval.kin, self.state.mode, at.0);
        for (i, guard) in self.guards.as_slice().iter().enumerate() {
            self.values[i] = guard.value(&self.model, &self.eval, self.state.mode, at);
        }
    }

    /// Handle an event and all events that follow at the same instant.
    pub(super) fn handle_event(&mut self, first: Guard) -> Result<(), Termination> {
        let mut next = Some(first);
        while let Some(guard) = next {
            self.stats.events += 1;
            self.charge()?;
            let passed = guard;
            let from = self.state.mode;
            let leg = self.state.support_leg;
            self.event_handler().handle(guard)?;
            if self.state.mode.free.touch != SoleContact::Air {
                let (q, v) = (self.state.q, self.state.v);
                self.eval
                    .set_configuration(&self.model, self.state.mode.support.touch, &q, &v);
                self.eval.assemble(&self.model, self.state.mode.free.touch);
                project(&self.model, &mut self.eval, &mut self.state)?;
            }
            self.begin_mode()?;
            if self.record_change(guard.describe(), from, leg) {
                self.begin_mode()?;
            }
            next = self.immediate_guard().filter(|&guard| {
                (guard, self.state.mode, self.state.support_leg) != (passed, from, leg)
            });
        }
        self.state.h = self.state.h.min(1e-3);
        Ok(())
    }

    /// Record a change of the contact mode or the supporting leg; `sole_points` must be up to date. Returns
    /// whether the controller has been sampled.
    pub(super) fn record_change(
        &mut self,
        what: &'static str,
        from: ContactMode,
        leg: Leg,
    ) -> bool {
        if (self.state.mode, self.state.support_leg) != (from, leg) {
            self.monitor.changed = self.state.t;
            self.events.push(Event {
                t: self.state.t,
                what,
                from,
                to: self.state.mode,
                leg: self.state.support_leg,
            });
        }
        if self.state.support_leg == leg {
            return false;
        }
        let sampled = !self.model.contact.is_unilateral();
        if sampled {
            // The paper's leg swap is an event of the controller, which counts t0 from it.
            self.sample();
        }
        if self.monitor.current.period >= MIN_STEP_PERIOD {
            self.records.push(self.monitor.current);
            self.monitor.next_gait_step(&self.state, &self.sole_points);
        }
        sampled
    }

    /// A guard that the new mode violates immediately. A guard within the slack is set just above zero, so
    /// that it fires in the next step if it decreases further.
    fn immediate_guard(&mut self) -> Option<Guard> {
        let slack = FORCE_SLACK * self.model.weight();
        let mut due = None;
        for (i, guard) in self.guards.as_slice().iter().enumerate() {
            if self.values[i] > 0.0 || !guard.binds_at_start(&self.model) {
                continue;
            }
            if !matches!(guard, Guard::Gap(..)) && self.values[i] > -slack {
                self.values[i] = f64::MIN_POSITIVE;
            } else {
                due = due.or(Some(*guard));
            }
        }
        due
    }

    fn count_step(&mut self) -> Result<(), Termination> {
        self.stats.steps += 1;
        self.check_velocities()?;
        self.charge()
    }

    /// Check that the velocities are within the range of the arithmetic.
    pub(super) fn check_velocities(&self) -> Result<(), Termination> {
        let bounded = is_bounded(&self.state.v[..self.model.n]);
        bounded.then_some(()).ok_or(Termination::NotFinite)
    }

    /// Charge the evaluations made so far to the budget.
    pub(super) fn charge(&mut self) -> Result<(), Termination> {
        let accuracy = self.model.scene.accuracy;
        self.budget.charge(accuracy, self.state.t, self.eval.count)
    }
}
