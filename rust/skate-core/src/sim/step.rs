//! One time step and the event that ends it.

use crate::{
    contact::equations::Z,
    error::Termination,
    events::{
        guard::{FORCE_TOLERANCE, Guard},
        guards::{Guards, MAX_GUARDS},
        observer::Operation,
    },
    integrate::{Method, Start},
    model::{
        contact_mode::{ContactMode, FREE, SUPPORT, SoleContact},
        layout::NV,
        state::{State, is_bounded},
    },
    rhs::{StepContext, projection::project, sole_points::SolePoints},
    scene::Leg,
    sim::{
        Event, NY, Simulation,
        event_location::StepEvent,
        gait_statistics::MIN_STEP_PERIOD,
        mode_system::{slope, unpack},
        trial::{EndPoint, Evaluated, Trial},
    },
};

/// Minimum time step [s].
const MIN_STEP: f64 = 1e-12;
/// Maximum length of the step after an event, as a multiple of the part of the last step before it. An end of a sole that
/// has just left the ice is lower than the error of the dense output of a long step, where it would be on the ice again.
const AFTER_EVENT: f64 = 20.0;
/// Largest defect of the dense output at an event, h (f(y) - y'), as a multiple of the tolerance. Its local error is not
/// controlled, and with h rho = 5 the forces, on which events depend, are less accurate than the state.
const MAX_DEFECT: f64 = 100.0;
/// Tolerance beyond which that defect does not grow: contact modes follow from forces, not from the state.
const MAX_EVENT_TOLERANCE: f64 = 5e-6;
/// Rate of a joint or of the supporting foot beyond which a motion that is too costly ends with `overspeed` [rad/s].
const OVERSPEED: f64 = 1e3;
/// Normal force of a foot beyond which it is wedged, in weights of the robot.
const MOST_LOAD: f64 = 1e4;
/// Fraction of the step from which on the dense output is as accurate as the end.
const NEAR_END: f64 = 0.97;

impl Simulation {
    /// Continue after a change of torques, which changes accelerations and forces and may trigger an event.
    pub(super) fn resume(&mut self) -> Result<(), Termination> {
        self.begin_mode()?;
        match self.immediate_guard() {
            Some(guard) => self.handle_event(guard),
            None => Ok(()),
        }
    }

    /// Advance to the time `until` [s] by steps between located events, while `go_on` returns true.
    pub(crate) fn advance_between_events(&mut self, until: f64, mut go_on: impl FnMut() -> bool) {
        if self.ended.is_none() && self.state.t < until {
            self.budget.add_call();
        }
        while self.ended.is_none() && self.state.t < until && go_on() {
            self.ended = self.advance_once(until).err();
        }
        self.update_counters();
    }

    /// One accepted time step and the event that ends it, if any: trials, until one is within the tolerance.
    fn advance_once(&mut self, until: f64) -> Result<(), Termination> {
        let mut trial = Trial::new(&self.state, self.method(), until);
        loop {
            trial.shorten(self.state.t);
            let outcome = self.compute(&trial);
            match self.judge(&mut trial, outcome) {
                Ok(Some(next_h)) => match self.accept(&trial, next_h, None)? {
                    Some(shorter) => trial = shorter,
                    None => return Ok(()),
                },
                Ok(None) => {}
                Err(cause) => return self.stop_at_singularity(cause),
            }
        }
    }

    /// Attempt a step; returns its error as a multiple of the tolerance, or why it is impossible.
    pub(crate) fn compute(&mut self, trial: &Trial) -> Result<f64, Termination> {
        let y = self.integrated_vector();
        self.guard_samples
            .start_step(self.guards, self.state.t, trial.h);
        let (t, slope) = (self.state.t, self.dy);
        let start = Start {
            t,
            y: &y,
            slope: &slope,
        };
        let (step, mut system) = self.mode_system();
        step.attempt(trial.method, &mut system, start, trial.h)?;
        self.evaluated = Evaluated::At(1.0);
        Ok(self.step.error(trial.method))
    }

    /// Length of the next step after an attempt within the tolerance [s]; else None, and a shorter trial.
    pub(crate) fn judge(
        &mut self,
        trial: &mut Trial,
        outcome: Result<f64, Termination>,
    ) -> Result<Option<f64>, Termination> {
        let error = outcome.unwrap_or(f64::INFINITY);
        let Trial {
            method, wanted, h, ..
        } = *trial;
        if error <= 1.0 {
            self.stats.error_estimate += error * method.tolerance().unwrap_or(0.0);
            let next = h * self.step.factor(method, error);
            return Ok(Some(if h < wanted { next.max(wanted) } else { next }));
        }
        self.stats.rejections += 1;
        trial.wanted = h * if error.is_finite() {
            self.step.factor(method, error).min(0.9)
        } else {
            0.1
        };
        if method.is_implicit() {
            // The method takes its matrix from the last evaluation, which must be at the present state.
            self.begin_mode()?;
        }
        if trial.wanted < MIN_STEP {
            return Err(outcome.err().unwrap_or(self.cost_limit()));
        }
        Ok(None)
    }

    /// Continue where no step is possible, if a foot slides there into Painleve's paradox: its normal force is 0/0, and
    /// may stay finite (Genot and Brogliato 1999). The foot stops in a tangential impact, as it does in the limit of a
    /// stiff contact (Nordmark, Varkonyi and Champneys 2018).
    ///
    /// # Errors
    /// `cause`, if it is another one, or if the foot cannot stop.
    pub(crate) fn stop_at_singularity(&mut self, cause: Termination) -> Result<(), Termination> {
        let mode = self.state.mode;
        let slides = |&which: &usize| mode.foot(which).friction_mode.has_dry_friction();
        let sliding = [SUPPORT, FREE].into_iter().find(slides);
        let (Termination::Singular, Some(which)) = (cause, sliding) else {
            return Err(cause);
        };
        self.begin_mode()?;
        self.handle_event(Guard::Wedge(which))?;
        let is_stopped = self.state.mode != mode;
        is_stopped.then_some(()).ok_or(cause)
    }

    /// Make an attempted step up to its first event, and handle that; `next_h` is the length of the next one. `end` is
    /// the end of a step that was computed in lanes; without it `eval` is the evaluation there. Returns the step to
    /// attempt instead, if that one was not accurate at the event.
    pub(crate) fn accept(
        &mut self,
        trial: &Trial,
        next_h: f64,
        end: Option<&EndPoint<'_>>,
    ) -> Result<Option<Trial>, Termination> {
        let Trial {
            method, h, until, ..
        } = *trial;
        let whole = self.state.t + h >= until;
        let (theta, mut event) = self.first_event(method, end)?;
        if event.is_some() && self.is_coarse_at(method, theta) {
            // Not necessarily accurate, although the longer step was: it has other stages.
            let wanted = theta * h;
            return Ok(Some(Trial { wanted, ..*trial }));
        }
        let before = self.state;
        let is_part = theta < 1.0 || event.is_some();
        if is_part {
            let y = self.step.at(theta);
            self.set_state(&y, before.t + theta * h);
            // At the end of the step the evaluation was at `y1`, which differs from `y` by rounding.
            if theta < 1.0 {
                self.read_slope();
                self.read_guards();
            } else {
                self.begin_mode()?;
            }
        } else {
            let y = self.step.y1;
            self.set_state(&y, if whole { until } else { before.t + h });
            self.state.h = next_h;
            self.dy = *self.step.dy1();
            match end {
                Some(end) => {
                    let n = self.guards.as_slice().len();
                    self.values[..n].copy_from_slice(&end.guards[..n]);
                    self.sole_points = end.sole_points;
                }
                None => self.read_guards(),
            }
        }
        let after = self.state;
        let end = end.filter(|_| !is_part);
        if end.is_none_or(|end| end.is_violated) {
            self.complete_evaluation()?;
            let values = self.values;
            if project(&self.model, &mut self.eval, &mut self.state)? {
                self.stats.projections += 1;
                self.begin_mode()?;
                event = event.or_else(|| self.crossed_since(&values));
            }
        }
        self.observe_step(method, (h, theta), event, (&before, &after, until));
        self.count_step()?;
        let (forces, sole_points) = (&self.eval.solution, &self.sole_points);
        self.monitor
            .accumulate(&self.model, forces, sole_points, &before, &self.state);
        match event {
            Some(StepEvent::Guard(guard)) => {
                // Not for an event at the start itself, as of a foot with a speed of 1e-300 m/s.
                if theta * h > MIN_STEP {
                    self.state.h = self.state.h.min(AFTER_EVENT * theta * h);
                }
                self.handle_event(guard)?;
            }
            Some(StepEvent::Sample) => {
                self.sample();
                self.resume()?;
            }
            None => self.detect_stiffness(method, h)?,
        }
        Ok(None)
    }

    /// Is the dense output too inaccurate at the event that `eval` was evaluated at? Then the step ends near it.
    fn is_coarse_at(&self, method: Method, theta: f64) -> bool {
        let explicit = !method.is_implicit() && theta < NEAR_END;
        let Some(tolerance) = method.tolerance().filter(|_| explicit) else {
            return false;
        };
        let y = self.step.at(theta);
        let mut dy = [0.0; NY];
        let (_, v) = unpack(&y, self.model.n);
        slope(&*self.model, &self.eval, self.state.mode, v, &mut dy);
        let tolerance = tolerance.min(MAX_EVENT_TOLERANCE);
        self.step.defect(theta, &dy, tolerance) > MAX_DEFECT
    }

    /// Integrated vector at the present state: q, v, energies.
    pub(crate) fn integrated_vector(&self) -> [f64; NY] {
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

    /// Evaluate at the present state.
    pub(crate) fn evaluate(&mut self) -> Result<(), Termination> {
        let context = StepContext::of(&self.model, &self.state, &self.residual);
        let State { q, v, .. } = &self.state;
        self.averaging_time = 0.0;
        self.eval.accelerations(&self.model, q, v, &context)
    }

    /// Evaluate at the present state and update the guards.
    pub(crate) fn begin_mode(&mut self) -> Result<(), Termination> {
        self.evaluate()?;
        self.read_slope();
        self.guards = Guards::of(&self.model, self.state.mode);
        self.read_guards();
        Ok(())
    }

    /// Take the slope at the present state from the last evaluation.
    fn read_slope(&mut self) {
        let State { v, mode, .. } = &self.state;
        slope(&*self.model, &self.eval, *mode, v, &mut self.dy);
    }

    fn read_guards(&mut self) {
        let at = (self.state.q[1], self.state.v[0]);
        self.sole_points = SolePoints::of_state(&self.model, &self.eval.kin, &self.state);
        for (i, guard) in self.guards.as_slice().iter().enumerate() {
            self.values[i] = guard.value(&*self.model, &self.eval, self.state.mode, at);
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
            self.observe(|observer, sim| observer.event(&sim.present(), guard));
            self.event_handler().handle(guard)?;
            // Time steps project at their ends, and their velocities satisfy other constraints.
            let projects = self.model.scheme.locates_events();
            if projects && self.state.mode.free.touch != SoleContact::Air {
                let (q, v) = (self.state.q, self.state.v);
                self.eval
                    .set_configuration(&self.model, self.state.mode.support.touch, &q, &v);
                self.eval.assemble(&self.model, self.state.mode.free.touch);
                self.observe_operation(Operation::Project(self.state.mode));
                project(&self.model, &mut self.eval, &mut self.state)?;
            }
            self.begin_mode()?;
            if self.record_change(guard.describe(), from, leg) {
                self.begin_mode()?;
            }
            next = self.immediate_guard().filter(|&guard| {
                (guard, self.state.mode, self.state.support_leg) != (passed, from, leg)
            });
            self.observe(|observer, sim| {
                observer.event_ends(&sim.present(), passed, (from, leg));
            });
        }
        self.state.h = self.state.h.min(self.method().max_step_after_event());
        Ok(())
    }

    /// Record an event, also one that leaves the contact mode as it is; `sole_points` must be up to date. Returns
    /// whether the controller has been sampled.
    pub(crate) fn record_change(
        &mut self,
        what: &'static str,
        from: ContactMode,
        leg: Leg,
    ) -> bool {
        if (self.state.mode, self.state.support_leg) != (from, leg) {
            self.monitor.changed = self.state.t;
            self.state.is_stiff = false;
            self.observe_operation(Operation::Changed);
        }
        self.events.push(Event {
            t: self.state.t,
            what,
            from,
            to: self.state.mode,
            leg: self.state.support_leg,
        });
        if self.state.support_leg == leg {
            return false;
        }
        let sampled = !self.model.contact.is_push_only;
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

    /// A guard that a projection at the end of a step has moved through zero. Its event is at the end.
    fn crossed_since(&self, values: &[f64; MAX_GUARDS]) -> Option<StepEvent> {
        let guards = self.guards.as_slice().iter().enumerate();
        let mut crossed = guards.filter(|&(i, guard)| {
            values[i] > 0.0 && self.values[i] <= 0.0 && guard.binds_at_start(&self.model)
        });
        crossed.next().map(|(_, &guard)| StepEvent::Guard(guard))
    }

    /// A guard that the new mode violates immediately. A force within its tolerance is set just above zero, so that it
    /// triggers in the next step if it decreases further. The signs of normal forces come first: friction depends on them.
    fn immediate_guard(&mut self) -> Option<Guard> {
        let tolerance = FORCE_TOLERANCE * self.model.weight();
        let mut due = None;
        for (i, guard) in self.guards.as_slice().iter().enumerate() {
            if self.values[i] > 0.0 || !guard.binds_at_start(&self.model) {
                continue;
            }
            let may_wait = !guard.is_kinematic() && !matches!(guard, Guard::Wedge(_));
            if may_wait && self.values[i] > -tolerance {
                self.values[i] = f64::MIN_POSITIVE;
            } else {
                due = match guard {
                    Guard::Pull(_) => Some(*guard),
                    _ => due.or(Some(*guard)),
                };
            }
        }
        due
    }

    fn count_step(&mut self) -> Result<(), Termination> {
        self.stats.steps += 1;
        self.check_velocities()?;
        self.check_loads()?;
        self.charge()
    }

    /// Check that no foot in two-way contact is wedged: the law has solutions that become infinite in finite time, in
    /// which the force is proportional to 1/(time left)^2.
    fn check_loads(&self) -> Result<(), Termination> {
        if self.model.contact.is_push_only {
            return Ok(());
        }
        let forces = &self.eval.solution;
        let largest = forces.f_root[Z].abs().max(forces.lam[Z].abs());
        let bounded = largest <= MOST_LOAD * self.model.weight();
        bounded.then_some(()).ok_or(Termination::Wedged)
    }

    /// Check that the velocities are within the range of the arithmetic.
    pub(crate) fn check_velocities(&self) -> Result<(), Termination> {
        let bounded = is_bounded(&self.state.v[..self.model.n]);
        bounded.then_some(()).ok_or(Termination::NotFinite)
    }

    /// Charge the evaluations made so far to the budget.
    pub(crate) fn charge(&mut self) -> Result<(), Termination> {
        let rate = self.model.usual_rate;
        let affordable = self.budget.charge(rate, self.state.t, self.eval.count);
        affordable.then_some(()).ok_or_else(|| self.cost_limit())
    }

    /// Why the motion is too costly to go on.
    fn cost_limit(&self) -> Termination {
        let rates = &self.state.v[2..self.model.n];
        if rates.iter().any(|rate| rate.abs() > OVERSPEED) {
            Termination::Overspeed
        } else {
            Termination::StepLimit
        }
    }
}
