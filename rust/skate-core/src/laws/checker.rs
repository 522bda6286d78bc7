//! The observer that checks the laws.

use crate::{
    contact::equations::Solution,
    events::{
        guard::Guard,
        observer::{AcceptedStep, Observer, Operation, Present, StepEnd},
    },
    laws::{Law, LawRecord, contact, instant::Instant, records::Records},
    model::{
        Model,
        contact_mode::{ContactMode, FREE},
        layout::NV,
        state::State,
    },
    rhs::{Evaluation, StepContext},
    scene::Leg,
};

/// Time after an event in which the chosen mode must stay consistent [s].
const SOON: f64 = 1e-6;
/// Forces that count as zero where one changes its sign, relative to the weight.
const SMALL_FORCE: f64 = 1e-6;
/// Change of velocity that counts as none [m/s].
const STILL: f64 = 1e-9;

/// Checks every law at every time step and event. See `laws`.
#[derive(Debug, Clone)]
pub struct LawChecker {
    records: Records,
    /// Workspace.
    eval: Box<Evaluation>,
    /// The motion so far: its last state, the start of the present flight, and the error of the energy balance [J].
    last: Option<Box<Instant>>,
    flight: Option<Box<Instant>>,
    error: Option<f64>,
    /// During an event: an impact has acted; a normal force has changed its sign, and a mode in which the forces go on
    /// from these is consistent.
    has_impact: bool,
    continuous: Option<Solution>,
}

impl LawChecker {
    pub fn new(model: &Model) -> Self {
        Self {
            records: Records::new(model),
            eval: Box::default(),
            last: None,
            flight: None,
            error: None,
            has_impact: false,
            continuous: None,
        }
    }

    pub fn records(&self) -> &[LawRecord] {
        self.records.as_slice()
    }

    fn instant(&mut self, model: &Model, state: &State) -> Box<Instant> {
        Box::new(Instant::of(model, &mut self.eval, state))
    }

    /// The state before a step or an event. Since the last one nothing may have happened to it, or with time stepping an
    /// event.
    fn before(&mut self, model: &Model, state: &State) -> Box<Instant> {
        match self.last.take() {
            Some(last) if last.state == *state => last,
            Some(last) => {
                let now = self.instant(model, state);
                self.check_event(model, &last, &now, None);
                now
            }
            None => self.instant(model, state),
        }
    }

    /// Accelerations and forces in a contact mode; None where they do not exist.
    fn evaluate(
        &mut self,
        model: &Model,
        (state, mode): (&State, ContactMode),
        residual: &[f64; NV],
    ) -> Option<Solution> {
        let state = State { mode, ..*state };
        let context = StepContext::of(model, &state, residual);
        let done = self.eval.accelerations(model, &state.q, &state.v, &context);
        done.ok().map(|()| self.eval.solution)
    }

    /// Contact and friction at the start or the end of a step between events.
    fn check_state(
        &mut self,
        model: &Model,
        state: &State,
        residual: &[f64; NV],
        (h, fired): (f64, Option<Guard>),
    ) {
        if self
            .evaluate(model, (state, state.mode), residual)
            .is_some()
        {
            self.check_contacts(model, state, (h, fired));
        }
    }

    /// The same for the kinematics and forces in the workspace.
    fn check_contacts(&mut self, model: &Model, state: &State, (h, fired): (f64, Option<Guard>)) {
        let (eval, records, event) = (&self.eval, &mut self.records, fired.map(Guard::describe));
        let mut report = |law, amount| {
            records.report(law, amount, state, event);
        };
        let forces = (state.levers(model), &eval.solution);
        contact::forces(model, state.mode, forces, fired, &mut report);
        contact::motion(model, eval, state, fired, &mut report);
        let brought = h * contact::friction_power(model, eval, state);
        report(Law::FrictionDissipates, brought);
    }

    /// What every step of either scheme keeps, from `before` to the state `after`.
    fn check_step(&mut self, model: &Model, before: Box<Instant>, after: &State) {
        let now = self.instant(model, after);
        self.check_rates(model, after, None);
        let slides = [&before.state, after].map(|state| state.mode.free.slides());
        let literal = model.contact.is_driven(FREE) && slides.contains(&true);
        if model.scene.energy_balance {
            let (old, new) = (before.state.energy_balance, after.energy_balance);
            let mut gains = |energy| {
                let law = Law::FrictionDissipates;
                self.records.report(law, energy, after, None);
            };
            if !literal {
                gains(old.friction - new.friction);
            }
            gains(old.damping - new.damping);
            let error = now.energy - new.total();
            let last = self.error.replace(error).unwrap_or(error);
            self.records
                .report(Law::EnergyBalance, (error - last).abs(), after, None);
        }
        if before.state.mode.is_flight() && after.mode.is_flight() {
            let start = self.flight.take().unwrap_or(before);
            let amount = now.unexplained_momentum(model, &start);
            let is_kept = self
                .records
                .report(Law::MomentumInFlight, amount, after, None);
            // One breach counts once.
            self.flight = is_kept.then_some(start);
        } else {
            self.flight = None;
        }
        self.last = Some(now);
    }

    /// What an event may not do to the motion.
    fn check_event(
        &mut self,
        model: &Model,
        before: &Instant,
        now: &Instant,
        event: Option<&'static str>,
    ) {
        let state = &now.state;
        self.check_rates(model, state, event);
        let gained = now.energy - before.energy;
        self.records
            .report(Law::ImpactsDissipate, gained, state, event);
        self.records
            .report(Law::NoJump, now.distance(before), state, event);
        let change = now.velocity_difference(before);
        if self.has_impact || change > STILL {
            // A foot may land and leave the ice at the same instant.
            self.flight = None;
        }
        if !self.has_impact {
            self.records
                .report(Law::VelocitiesNeedImpacts, change, state, event);
        }
        self.has_impact = false;
    }

    fn check_rates(&mut self, model: &Model, state: &State, event: Option<&'static str>) {
        let rates = &state.v[2..model.n];
        let fastest = rates.iter().fold(0.0_f64, |so_far, v| so_far.max(v.abs()));
        self.records.report(Law::FiniteRates, fastest, state, event);
    }

    /// The forces before a change of sign, if they can go on from there: friction of that foot is switched on or off
    /// while it is zero.
    fn continuous_forces(&mut self, present: &Present<'_>, which: usize) -> Option<Solution> {
        let before = present.eval.solution;
        let mode = present.state.mode.with_reversed_pull(which);
        let small = SMALL_FORCE * present.model.weight();
        let mut ahead = *present.state;
        for time in [0.0, SOON] {
            if time > 0.0 {
                ahead.t += time;
                for c in 0..present.model.n {
                    ahead.q[c] += time * ahead.v[c];
                    ahead.v[c] += time * self.eval.qdd[c];
                }
            }
            let forces = self.evaluate(present.model, (&ahead, mode), present.residual)?;
            let lever = present.state.levers(present.model);
            let mut worst = f64::NEG_INFINITY;
            contact::forces(present.model, mode, (lever, &forces), None, |_, amount| {
                worst = worst.max(amount);
            });
            if worst > small || time == 0.0 && force_jump(&before, &forces) > small {
                return None;
            }
        }
        Some(before)
    }
}

/// Largest difference of contact forces and couples [N, N m].
fn force_jump(a: &Solution, b: &Solution) -> f64 {
    let support = (a.f_root - b.f_root).amax();
    support.max((a.lam - b.lam).amax())
}

impl Observer for LawChecker {
    fn copy(&self) -> Option<Box<dyn Observer>> {
        Some(Box::new(self.clone()))
    }

    fn begins(&mut self, model: &Model, state: &State) {
        self.records.set_limits(model);
        (self.flight, self.error, self.has_impact) = (None, None, false);
        self.last = Some(self.instant(model, state));
    }

    fn operation(&mut self, operation: Operation) {
        self.has_impact |= matches!(operation, Operation::Impact { .. });
    }

    fn step(&mut self, present: &Present<'_>, step: &AcceptedStep<'_>) {
        let (model, residual) = (present.model, present.residual);
        let before = self.before(model, step.before);
        let h = step.theta * step.h;
        self.check_state(model, step.before, residual, (h, None));
        let fired = match step.end {
            StepEnd::Guard(guard) => Some(guard),
            _ => None,
        };
        if step.end != StepEnd::Length {
            // Otherwise the next step begins with this state.
            self.check_state(model, present.state, residual, (h, fired));
        }
        self.check_step(model, before, present.state);
    }

    fn time_step(
        &mut self,
        present: &Present<'_>,
        start: &State,
        (h, _): (f64, f64),
        landing: Option<Guard>,
    ) {
        let Present { model, state, .. } = *present;
        let begin = self.before(model, start);
        let State { q, v, mode, .. } = state;
        self.eval.set_planar_configuration(model, *mode, q, v);
        self.eval.solution = present.eval.solution;
        self.check_contacts(model, state, (h, landing));
        self.check_step(model, begin, state);
    }

    fn event(&mut self, present: &Present<'_>, guard: Guard) {
        let Present { model, state, .. } = *present;
        let before = self.before(model, state);
        self.last = Some(before);
        self.continuous = match guard {
            Guard::Pull(which) => self.continuous_forces(present, which),
            _ => None,
        };
    }

    fn event_ends(&mut self, present: &Present<'_>, guard: Guard, _: (ContactMode, Leg)) {
        let model = present.model;
        let before = self.last.take();
        let now = self.instant(model, present.state);
        if let Some(before) = before {
            self.check_event(model, &before, &now, Some(guard.describe()));
        }
        if let Some(before) = self.continuous.take() {
            let jump = force_jump(&present.eval.solution, &before);
            let event = Some(guard.describe());
            self.records
                .report(Law::ForcesContinuous, jump, present.state, event);
        }
        self.last = Some(now);
    }
}
