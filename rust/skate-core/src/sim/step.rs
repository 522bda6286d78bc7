//! One step and the event it ends with.

use crate::{
    error::Termination,
    events::guards::{FORCE_SLACK, Guard, Guards},
    integrate::{Method, System},
    model::{
        contact_mode::{ContactMode, SoleContact},
        layout::NV,
        state::is_bounded,
    },
    rhs::{StepContext, projection::project, sole_points::SolePoints},
    scene::Leg,
    sim::{
        Event, NY, Simulation, event_location::Happening, gait_statistics::FLUTTER,
        mode_system::ModeSystem,
    },
};

/// Longest and shortest step [s].
const LONGEST: f64 = 0.1;
const SHORTEST: f64 = 1e-12;

impl Simulation {
    /// A new torque means new accelerations and forces, and perhaps another contact state.
    pub(super) fn resume(&mut self) -> Result<(), Termination> {
        self.begin_mode()?;
        match self.due_at_once() {
            Some(guard) => self.pass(guard),
            None => Ok(()),
        }
    }

    /// One accepted step, and the event it ends with, if any.
    pub(super) fn advance_once(&mut self, method: Method, until: f64) -> Result<(), Termination> {
        let (h, grow) = self.attempt(method, until)?;
        let whole = self.state.t + h >= until;
        let (theta, event) = self.first_event(method)?;
        let before = self.state;
        if theta < 1.0 || event.is_some() {
            let y = self.step.at(theta);
            self.take(&y, before.t + theta * h);
            self.begin_mode()?;
        } else {
            let y = self.step.y1;
            self.take(&y, if whole { until } else { before.t + h });
            self.state.h = grow;
            self.dy = *self.step.dy1();
            self.read_guards();
        }
        if project(&self.model, &mut self.eval, &mut self.state)? {
            self.stats.projections += 1;
            self.begin_mode()?;
        }
        self.count_step()?;
        let here = (&self.eval.solution, &self.sole_points);
        self.monitor.watch(&self.model, here, &before, &self.state);
        match event {
            Some(Happening::Guard(guard)) => self.pass(guard),
            Some(Happening::Sample) => {
                self.sample();
                self.resume()
            }
            None => Ok(()),
        }
    }

    /// Step from the present state until the error fits; returns the step size and the next one.
    fn attempt(&mut self, method: Method, until: f64) -> Result<(f64, f64), Termination> {
        let state = &self.state;
        let left = until - state.t;
        let mut h = method.step().unwrap_or(state.h.min(LONGEST));
        let y = self.packed();
        loop {
            let wanted = h;
            // Never leave a sliver for the next step.
            if method.step().is_some() {
                h = left / (left / h - 1e-9).ceil().max(1.0);
            } else if h > left * (1.0 - 1e-9) {
                h = left;
            } else if h > 0.5 * left {
                h = 0.5 * left;
            }
            self.stage_guards.begin(self.guards, self.state.t, h);
            let mut robot = ModeSystem {
                model: &self.model,
                eval: &mut self.eval,
                implicit: &mut self.implicit,
                stage_guards: &mut self.stage_guards,
                frozen: StepContext::of(&self.model, &self.state, &self.residual),
            };
            let start = (self.state.t, &y, &self.dy);
            let done = self.step.attempt(method, &mut robot, start, h);
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
                // It takes its matrix from where the system was last evaluated.
                self.begin_mode()?;
            }
            if h < SHORTEST {
                return Err(done.err().unwrap_or(Termination::StepLimit));
            }
        }
    }

    /// The integrated vector at the state: q, v, powers.
    fn packed(&self) -> [f64; NY] {
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

    fn take(&mut self, y: &[f64; NY], t: f64) {
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

    /// Evaluate at the state and read the guards.
    pub(crate) fn begin_mode(&mut self) -> Result<(), Termination> {
        let y = self.packed();
        self.stage_guards.begin(self.guards, self.state.t, 0.0);
        let mut robot = ModeSystem {
            model: &self.model,
            eval: &mut self.eval,
            implicit: &mut self.implicit,
            stage_guards: &mut self.stage_guards,
            frozen: StepContext::of(&self.model, &self.state, &self.residual),
        };
        robot.rhs(self.state.t, &y, &mut self.dy)?;
        self.averaged = 0.0;
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

    /// Pass an event, and whatever follows from it at the same instant.
    pub(super) fn pass(&mut self, first: Guard) -> Result<(), Termination> {
        let mut next = Some(first);
        while let Some(guard) = next {
            self.stats.events += 1;
            self.spend()?;
            let passed = guard;
            let from = self.state.mode;
            let leg = self.state.support_leg;
            self.passage().through(guard)?;
            if self.state.mode.free.touch != SoleContact::Air {
                let (q, v) = (self.state.q, self.state.v);
                self.eval
                    .move_to(&self.model, self.state.mode.support.touch, &q, &v);
                self.eval.assemble(&self.model, self.state.mode.free.touch);
                project(&self.model, &mut self.eval, &mut self.state)?;
            }
            self.begin_mode()?;
            if self.note(guard.describe(), from, leg) {
                self.begin_mode()?;
            }
            next = self.due_at_once().filter(|&guard| {
                (guard, self.state.mode, self.state.support_leg) != (passed, from, leg)
            });
        }
        self.state.h = self.state.h.min(1e-3);
        Ok(())
    }

    /// Remember what has become of a mode and a supporting leg; `sole_points` are of the present state.
    /// Returns whether the controller has looked.
    pub(super) fn note(&mut self, what: &'static str, from: ContactMode, leg: Leg) -> bool {
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
        let looks = !self.model.contact.is_unilateral();
        if looks {
            // The paper's swap is the controller's own event; it counts t0 from there.
            self.sample();
        }
        if self.monitor.current.period >= FLUTTER {
            self.records.push(self.monitor.current);
            self.monitor.next(&self.state, &self.sole_points);
        }
        looks
    }

    /// A guard that the new mode violates from its first instant. One within the slack is set to
    /// fire in the next step if it goes on falling.
    fn due_at_once(&mut self) -> Option<Guard> {
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
        self.spend()
    }

    /// Are the velocities such as the arithmetic can hold?
    pub(super) fn check_velocities(&self) -> Result<(), Termination> {
        let bounded = is_bounded(&self.state.v[..self.model.n]);
        bounded.then_some(()).ok_or(Termination::NotFinite)
    }

    /// Count the evaluations made so far.
    pub(super) fn spend(&mut self) -> Result<(), Termination> {
        let accuracy = self.model.scene.accuracy;
        self.budget.spend(accuracy, self.state.t, self.eval.count)
    }
}
