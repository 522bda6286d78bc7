//! Time stepping after Moreau (1988): steps of given length in which contacts act by impulses. Steps are shorter where
//! legs move quickly, where two feet may rattle, and after a jump of the torques.
//!
//! The equations are evaluated once a step, at the midpoint predicted with the old velocities. The new velocities
//! satisfy the contact constraints at the end of the step. Without events the method has order 2. Joint friction,
//! visual lifting and head damping act on the mean of old and new velocities and positions: the matrix
//! M + h/2 D + J^T (h/2 D_h + h^2/4 K_p) J replaces M, so stiff terms do not limit the step. Signs of impulses and new
//! velocities decide between sticking and slipping. A landing ends a step early; in two-way contact so does a lift-off.
//! Slow feet are not captured; friction brings them to rest. The controller samples between steps; for the switch of
//! Eq. 21 a step uses the mean over the samples within it.

mod landing_time;
mod lanes;
mod step;
mod step_contacts;
mod trial_steps;

use crate::{
    control::ControllerInput,
    error::Termination,
    events::{EventHandler, guard::Guard},
    model::{
        contact_mode::{ContactMode, End, SoleContact, touches},
        controller_state::TICK_ROUNDING,
        friction::FrictionMode,
        layout::{LEG, NV, ROOT},
        state::State,
    },
    numeric::{scalar::Scalar, simd::with_avx2},
    rhs::Stance,
    scene::Way,
    sim::Simulation,
};
pub use lanes::HasSimulation;
pub(crate) use lanes::MAX_BATCH;
pub(super) use lanes::advance_many;
use step::{MoreauStep, Motion, glide};
use step_contacts::StepContacts;
use trial_steps::{Means, Progress, StepRequest, Stepping};

/// What is left of the time after a landing, or before a sample, is not stepped if it is this short [s]:
/// divided by it, rounding would be a force.
const SLIVER: f64 = 1e-8;
/// The part of its length that a step has where legs move quickly, or ice that only pushes has both feet on it,
const SHORT: f64 = 0.5;
/// and the first one after torques have jumped: a foot turns within a millisecond.
const FIRST: f64 = 0.25;
/// Legs whose joints turn by less in a whole step are calm [rad].
const CALM: f64 = 0.035;
/// An end this high above the ice is on it [m].
const CLOSED: f64 = 1e-9;

/// A simulation on its way to a certain time.
#[derive(Debug, Clone)]
pub(super) struct StepDriver {
    until: f64,
    /// Length of a whole step [s].
    length: f64,
    step: Stepping,
    /// A step is under way,
    steps: bool,
    /// and so much was left of the time when it began [s].
    left: f64,
    /// The controller's last sample before it.
    tick: i64,
    /// The controller has looked at the present state: it would see nothing else.
    sampled: bool,
    /// Mean forces over the last step, if those of the present follow from them without a jump.
    means: Option<Means>,
}

impl StepDriver {
    pub fn to(sim: &mut Simulation, until: f64) -> Self {
        let mut way = Self {
            until,
            length: 0.0,
            step: Stepping::at(sim),
            steps: false,
            left: 0.0,
            tick: 0,
            sampled: false,
            means: None,
        };
        way.set_out(sim, until);
        way
    }

    /// Begin anew, for another simulation of the same structure: guards by contact state are the same for it.
    pub fn set_out(&mut self, sim: &mut Simulation, until: f64) {
        if sim.ended.is_none() && sim.state.t < until {
            sim.budget.add_call();
        }
        sim.prefetch_log();
        self.until = until;
        self.length = match sim.model.scene.accuracy.way() {
            Way::TimeSteps { step } => step,
            Way::Events(_) => until - sim.state.t,
        };
        (self.steps, self.sampled) = (false, false);
        self.means = (sim.averaging_time > 0.0).then_some(Means {
            forces: sim.eval.solution,
            h: sim.averaging_time,
        });
    }

    /// The next motion wanted; None at the end of the way, or of the simulation.
    #[inline(never)]
    pub fn wish(&mut self, sim: &mut Simulation) -> Option<&StepRequest> {
        while !self.steps && sim.ended.is_none() && sim.state.t < self.until {
            sim.ended = self.begin(sim).err();
        }
        (self.steps && sim.ended.is_none()).then_some(&self.step.wish)
    }

    /// The wish has come true.
    pub fn after(&mut self, sim: &mut Simulation, mode: Result<ContactMode, Termination>) {
        let done = mode.and_then(|mode| self.go_on(sim, mode));
        sim.ended = done.err();
    }

    /// Make forces known: means over the last step, or where contacts have changed since what they are now.
    pub fn end(&self, sim: &mut Simulation) {
        if sim.ended.is_none() {
            match self.means {
                Some(means) => (sim.eval.solution, sim.averaging_time) = (means.forces, means.h),
                None => sim.ended = sim.begin_mode().err(),
            }
        }
        sim.update_counters();
    }

    /// Begin a step, if there is time for one.
    fn begin(&mut self, sim: &mut Simulation) -> Result<(), Termination> {
        sim.stats.steps += 1;
        // A motion ends where velocities are bounded; what else happens may leave others.
        if self.means.is_none() {
            sim.check_velocities()?;
        }
        sim.charge()?;
        let left = self.until - sim.state.t;
        if left < SLIVER {
            sim.state.t = self.until;
            self.means = None;
            return Ok(());
        }
        let mut h = sim.time_step(left, self.length);
        sim.torque_jumped = false;
        self.tick = sim.tick();
        if !self.sampled {
            h = h.min(sim.until_noticed());
        }
        self.left = left;
        self.step.begin(sim, (h, self.length), self.means)?;
        self.steps = true;
        Ok(())
    }

    fn go_on(&mut self, sim: &mut Simulation, mode: ContactMode) -> Result<(), Termination> {
        let Progress::Done(event) = self.step.after(sim, mode)? else {
            return Ok(());
        };
        self.steps = false;
        if event.is_none() && self.step.h == self.left {
            sim.state.t = self.until;
        }
        if sim.sole_points.above_fall <= 0.0 {
            return Err(Termination::Fall);
        }
        self.means = event.is_none().then_some(Means {
            forces: sim.eval.solution,
            h: self.step.h,
        });
        if let Some(guard) = event {
            sim.land(guard)?;
        }
        self.sampled = sim.tick() > self.tick;
        if self.sampled {
            sim.sample();
        }
        Ok(())
    }
}

impl Simulation {
    /// Advance to the time `until` by steps.
    pub(super) fn advance_by_steps(&mut self, until: f64) {
        let mut way = StepDriver::to(self, until);
        while let Some(wish) = way.wish(self) {
            let mode = self.glide(wish);
            way.after(self, mode);
        }
        way.end(self);
    }

    /// Move as wished and return the mode that the impulses are consistent with. If it has other touches
    /// than the start's, nothing has moved.
    fn glide(&mut self, wish: &StepRequest) -> Result<ContactMode, Termination> {
        let StepRequest { start, h, freedom } = wish;
        let energy_balance = &start.energy_balance;
        let mut step = MoreauStep {
            start: Motion {
                q: start.q,
                v: start.v,
                anchor: start.anchor,
                energies: [
                    energy_balance.actuators,
                    energy_balance.damping,
                    energy_balance.friction,
                ],
            },
            h: *h,
            residual: self.residual,
            ..MoreauStep::default()
        };
        let stance = Stance::of(&self.model, start.mode);
        let now = [middle(start, *h)];
        let (modes, freedom) = ([start.mode], [*freedom]);
        let mut feet = StepContacts::new(&*self.model, &modes, &freedom);
        let eval = &mut self.eval;
        let moved = with_avx2(
            #[inline(always)]
            || glide(eval, &mut feet, &mut step, &stance, &now),
        );
        let outcome = feet.outcome(0);
        let moved = moved.then_some((&step, &step.end.q, &step.end.v));
        self.take_glided(wish, outcome, moved, 0);
        outcome
    }

    /// Take over where a motion has led in a lane, to positions and velocities that are given besides.
    #[inline(always)]
    fn take_glided<T: Scalar>(
        &mut self,
        wish: &StepRequest,
        outcome: Result<ContactMode, Termination>,
        glided: Option<(&MoreauStep<T>, &[f64; NV], &[f64; NV])>,
        lane: usize,
    ) {
        self.eval.count += 1;
        let (Some((glided, q, v)), Ok(mode)) = (glided, outcome) else {
            return;
        };
        if touches(mode) != touches(wish.start.mode) {
            return;
        }
        let (state, end) = (&mut self.state, &glided.end);
        state.t = wish.start.t + wish.h;
        state.mode = mode;
        // One after the other: a pair of them would be put together first.
        state.q = *q;
        state.v = *v;
        state.anchor = end.anchor.lane(lane);
        state.energy_balance.actuators = end.energies[0].lane(lane);
        state.energy_balance.damping = end.energies[1].lane(lane);
        state.energy_balance.friction = end.energies[2].lane(lane);
        glided.forces.lane_to(lane, &mut self.eval.solution);
        glided.sole_points.lane_to(lane, &mut self.sole_points);
    }

    /// The length of a step from the present state, of which whole ones have some `length` [s].
    fn longest(&self, length: f64) -> f64 {
        let State { v, mode, .. } = &self.state;
        let calm = v[ROOT..LEG].iter().all(|rate| rate.abs() * length < CALM);
        let (support, free) = touches(*mode);
        let rattles = self.model.contact.is_unilateral()
            && support != SoleContact::Air
            && free != SoleContact::Air;
        if calm && !rattles {
            length
        } else {
            SHORT * length
        }
    }

    /// The next of as few equal steps as make up the time that is `left`, whole ones of some `length` [s].
    pub(super) fn time_step(&self, left: f64, length: f64) -> f64 {
        let h = left / (left / self.longest(length) - 1e-9).ceil().max(1.0);
        if self.torque_jumped {
            h.min(FIRST * length)
        } else {
            h
        }
    }

    /// Push-only: all ends that are on the ice, and do not leave it within half a step, may act.
    fn close_ends(&mut self, h: f64) -> Result<(), Termination> {
        let mode = self.state.mode;
        let closed = self.sole_points.closed_ends(&self.model, |gap, rise| {
            gap.max(gap + 0.5 * h * rise) <= CLOSED
        });
        if closed != touches(mode) {
            let before = self.state;
            self.happen(&before, |passage| passage.close_ends(closed))?;
        }
        Ok(())
    }

    /// Pass a landing at the present state.
    fn land(&mut self, guard: Guard) -> Result<(), Termination> {
        let (before, sole_points) = (self.state, self.sole_points);
        self.happen(&before, |passage| passage.land(guard, &sole_points))
    }

    /// Time to the controller's next sample, if it will notice something then that has changed [s].
    fn until_noticed(&self) -> f64 {
        if self.sampled() == self.state.controller {
            return f64::INFINITY;
        }
        let next = (self.tick() + 1) as f64 * self.model.scene.control.sample_period;
        (next - self.state.t).max(SLIVER)
    }

    /// The controller's last sample, counted from t = 0.
    fn tick(&self) -> i64 {
        ((self.state.t + TICK_ROUNDING) / self.model.scene.control.sample_period) as i64
    }

    /// Pass an event: find the bodies after it, and remember what was `before`.
    fn happen(
        &mut self,
        before: &State,
        event: impl FnOnce(&mut EventHandler<'_>) -> Result<(), Termination>,
    ) -> Result<(), Termination> {
        let mut passage = self.event_handler();
        event(&mut passage)?;
        self.sole_points = passage.sole_points_after();
        self.remember(before)
    }

    /// Remember what has become of the contacts.
    fn remember(&mut self, before: &State) -> Result<(), Termination> {
        if before.mode == self.state.mode {
            return Ok(());
        }
        if let Some(guard) = velocity_change(before.mode, self.state.mode) {
            self.stats.events += 1;
            self.charge()?;
            self.record_change(guard.describe(), before.mode, before.support_leg);
        }
        Ok(())
    }
}

/// What the controller sees in the middle of a step.
fn middle(start: &State, h: f64) -> ControllerInput {
    ControllerInput {
        t: start.t + 0.5 * h,
        ..ControllerInput::of(start)
    }
}

/// The guard that would have ended `from` with `to`: the first difference between them.
fn velocity_change(from: ContactMode, to: ContactMode) -> Option<Guard> {
    let feet = [(from.support, to.support), (from.free, to.free)];
    for (which, (from, to)) in feet.into_iter().enumerate() {
        for (end, was, is) in [
            (End::Heel, from.touch.heel(), to.touch.heel()),
            (End::Toe, from.touch.toe(), to.touch.toe()),
        ] {
            match (was, is) {
                (false, true) => return Some(Guard::Gap(which, end)),
                (true, false) => return Some(Guard::Load(which, end)),
                _ => {}
            }
        }
        match to.friction_mode {
            _ if from.friction_mode == to.friction_mode && from.pulled != to.pulled => {
                return Some(Guard::Pull(which));
            }
            friction_mode if from.friction_mode == friction_mode => {}
            FrictionMode::Stuck => return Some(Guard::Reversal(which)),
            FrictionMode::Backward => return Some(Guard::ConeBackward(which)),
            FrictionMode::Forward | FrictionMode::Frictionless => {
                return Some(Guard::ConeForward(which));
            }
        }
    }
    None
}
