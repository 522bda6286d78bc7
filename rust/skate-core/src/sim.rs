//! The loop: step, look for events, pass them.

use crate::{
    contact::{Foot, Grip, Mode, Touch, Y},
    control::Clock,
    error::{EndCause, Invalid},
    evaluate::{Evaluation, Frozen},
    guards::{FORCE_SLACK, Guard, Guards, MOST},
    integrate::{
        Flow,
        dopri5::{Step, step_factor},
    },
    model::{FREE_FOOT, Model, NV, ROOT},
    monitor::{Monitor, StepRecord},
    project::project,
    scene::{ContactLaw, Leg},
    state::{Ledger, State, check_finite},
    transition::{Passage, closed_ends, sample, sampled},
};
use serde::{Deserialize, Serialize};

/// Components of the integrated vector: q, v, and three powers.
pub(crate) const NY: usize = 2 * NV + 3;
const POWERS: usize = 2 * NV;
/// Longest and shortest step [s].
const LONGEST: f64 = 0.01;
const SHORTEST: f64 = 1e-12;
/// Events are located to this [s].
const EVENT_TIME: f64 = 1e-13;
/// Ticks of the controller's clock are this exact [s]: rounding of t after an hour.
const TICK_ROUNDING: f64 = 1e-12;
/// More events than this at one instant (within `CROWD_TIME`) end the simulation.
const CROWD: u32 = 60;
const CROWD_TIME: f64 = 1e-7;
/// Scales of the error control: 1 rad (m) and 10 rad/s (m/s).
const SCALE: [f64; NY] = {
    let mut scale = [f64::INFINITY; NY];
    let mut i = 0;
    while i < NV {
        scale[i] = 1.0;
        scale[NV + i] = 10.0;
        i += 1;
    }
    scale
};

/// Counts since the start.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq, Serialize, Deserialize)]
pub struct Stats {
    pub steps: u64,
    pub rejections: u64,
    pub evaluations: u64,
    pub events: u64,
    pub root_iterations: u64,
    pub projections: u64,
}

/// Something that happened.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Event {
    pub t: f64,
    pub what: &'static str,
    /// Modes before and after.
    pub from: Mode,
    pub to: Mode,
    /// Supporting leg afterwards.
    pub leg: Leg,
}

/// One robot on one sheet of ice.
#[derive(Debug, Clone)]
pub struct Simulation {
    pub model: Model,
    pub state: State,
    /// Evaluated at `state`.
    pub eval: Evaluation,
    pub stats: Stats,
    pub ended: Option<EndCause>,
    pub(crate) monitor: Monitor,
    guards: Guards,
    /// Guard values at `state`.
    pub(crate) values: [f64; MOST],
    pub(crate) dy: [f64; NY],
    step: Step<NY>,
    pub(crate) residual: [f64; NV],
    pub(crate) crowd: (f64, u32),
    events: Vec<Event>,
    records: Vec<StepRecord>,
}

struct RobotFlow<'a> {
    model: &'a Model,
    eval: &'a mut Evaluation,
    frozen: Frozen,
}

/// Positions and velocities in the integrated vector.
fn unpack(y: &[f64; NY]) -> (&[f64; NV], &[f64; NV]) {
    let (q, rest) = y.split_first_chunk().expect("NY > NV");
    let (v, _) = rest.split_first_chunk().expect("NY > 2 NV");
    (q, v)
}

impl Flow<NY> for RobotFlow<'_> {
    fn rhs(&mut self, t: f64, y: &[f64; NY], dy: &mut [f64; NY]) -> Result<(), EndCause> {
        let (q, v) = unpack(y);
        self.frozen.now.t = t;
        self.eval.accelerations(self.model, q, v, &self.frozen)?;
        dy[..NV].copy_from_slice(v);
        dy[NV..POWERS].copy_from_slice(&self.eval.qdd);
        let (mut actuators, mut damping) = (0.0, 0.0);
        // Coordinates that the model does not have keep v = 0.
        for c in 0..NV {
            actuators += self.eval.tau[c] * v[c];
            damping += self.model.damping[c] * v[c] * v[c];
        }
        let mut friction = 0.0;
        if self.frozen.mode.support.slides() {
            friction -= self.eval.solution.f_root[Y] * v[0];
        }
        if self.frozen.mode.free.slides() {
            friction -= self.eval.solution.lam[Y] * self.eval.point_velocity[Y];
        }
        dy[POWERS..].copy_from_slice(&[actuators, damping, friction]);
        Ok(())
    }
}

impl Simulation {
    /// A simulation at the scene's start.
    ///
    /// # Errors
    /// `Invalid` where the start is not one: see `reset`.
    pub fn new(model: Model) -> Result<Self, Invalid> {
        let start = &model.scene.start;
        let (q, v) = (model.from_names(&start.q), model.from_names(&start.v));
        let state = State {
            t: 0.0,
            q,
            v,
            mode: Mode {
                support: Foot::AIR,
                free: Foot::AIR,
            },
            support_leg: start.support_leg,
            clock: Default::default(),
            anchor: 0.0,
            ledger: Ledger::default(),
            h: 1e-4,
        };
        let eval = Evaluation::default();
        let mut sim = Self {
            monitor: Monitor::new(&model, &state, &eval),
            guards: Guards::of(&model, state.mode),
            values: [0.0; MOST],
            dy: [0.0; NY],
            step: Step::new(),
            residual: [0.0; NV],
            crowd: (0.0, 0),
            events: Vec::new(),
            records: Vec::new(),
            stats: Stats::default(),
            ended: None,
            model,
            state,
            eval,
        };
        sim.reset(&q, &v, state.support_leg)?;
        Ok(sim)
    }

    /// Start anew at t = 0 from a state whose supporting foot stands flat or on an edge.
    ///
    /// # Errors
    /// `Invalid`, and nothing has changed, where a number is not finite or a foot is below the ice.
    pub fn reset(&mut self, q: &[f64; NV], v: &[f64; NV], leg: Leg) -> Result<(), Invalid> {
        let n = self.model.n;
        check_finite("q", &q[..n])?;
        check_finite("v", &v[..n])?;
        let mut fresh = self.clone();
        fresh.stats = Stats::default();
        fresh.events.clear();
        fresh.records.clear();
        fresh.ended = None;
        fresh.crowd = (0.0, 0);
        fresh.residual = [0.0; NV];
        fresh.eval.count = 0;
        let touch = if q[2] > 0.0 { Touch::Heel } else { Touch::Toe };
        fresh.state = State {
            t: 0.0,
            q: *q,
            v: *v,
            mode: Mode {
                support: Foot::new(touch, Grip::Stuck),
                free: Foot::AIR,
            },
            support_leg: leg,
            clock: Clock {
                leg,
                ..Clock::default()
            },
            anchor: 0.0,
            ledger: Ledger::default(),
            h: 1e-4,
        };
        fresh.first_mode()?;
        *self = fresh;
        Ok(())
    }

    /// Which ends of the soles are on the ice at the start, and how they move.
    fn first_mode(&mut self) -> Result<(), Invalid> {
        let (q, v) = (self.state.q, self.state.v);
        let touch = self.state.mode.support.touch;
        self.eval.move_to(&self.model, touch, &q, &v);
        let gaps = self.eval.gaps(&self.model, touch, q[1]);
        let push_only = self.model.scene.contact.law == ContactLaw::PushOnly;
        let names = [
            ["supporting heel", "supporting toe"],
            ["free heel", "free toe"],
        ];
        for foot in 0..2 {
            for end in 0..2 {
                // Table 2 knows no contact of the free toe alone; two-way contact leaves it out.
                let counts = push_only || (foot, end) != (1, 1);
                if counts && gaps[foot][end] < -START_DEPTH {
                    return Err(Invalid(format!(
                        "the {} starts {} m below the ice; its height must be at least 0",
                        names[foot][end], -gaps[foot][end]
                    )));
                }
            }
        }
        let [support, free] = closed_ends(gaps.map(|foot| foot.map(|gap| gap - START_DEPTH)));
        let free = if push_only || free == Touch::Flat {
            free
        } else {
            Touch::Air
        };
        if support == Touch::Air && !push_only {
            return Err(Invalid("the supporting foot starts above the ice".into()));
        }
        let grip = match v[0] {
            speed if speed > 0.0 => Grip::Forward,
            speed if speed < 0.0 => Grip::Backward,
            _ => Grip::Stuck,
        };
        let near = Mode {
            support: Foot::new(support, grip),
            free: Foot::new(free, Grip::Forward),
        };
        self.state.mode.support.grip = grip;
        // Where nothing runs into the ice nothing needs to be stopped.
        let flat = support == Touch::Flat;
        let calm = free == Touch::Air && v[1] == 0.0 && !(flat && v[2] != 0.0);
        let mut passage = self.passage();
        let begun = if calm {
            let moving = (grip != Grip::Stuck).then_some(grip);
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
        sample(&self.model, &mut self.state, self.eval.kin.angle[FREE_FOOT]);
        self.ended = self.resume().err();
        self.monitor = Monitor::new(&self.model, &self.state, &self.eval);
        Ok(())
    }

    fn passage(&mut self) -> Passage<'_> {
        Passage {
            model: &self.model,
            eval: &mut self.eval,
            state: &mut self.state,
            residual: &mut self.residual,
        }
    }

    /// Hold joint torques (n - 3 of them, without the root) from now on [N m].
    pub fn hold(&mut self, torque: &[f64]) {
        let joints = &mut self.residual[ROOT..self.model.n];
        if joints == torque || self.ended.is_some() {
            return;
        }
        joints.copy_from_slice(torque);
        let resumed = self.resume();
        self.ended = resumed.err();
    }

    /// A new torque means new accelerations and forces, and perhaps another contact state.
    fn resume(&mut self) -> Result<(), EndCause> {
        self.begin_mode()?;
        match self.due_at_once() {
            Some(guard) => self.pass(guard),
            None => Ok(()),
        }
    }

    /// The end of the present action period; periods are counted from t = 0.
    pub fn next_action_time(&self) -> f64 {
        let period = self.model.scene.control.action_period;
        ((self.state.t / period).round() + 1.0) * period
    }

    /// Advance to the time `until`, or to the end that `ended` names.
    pub fn advance(&mut self, until: f64) {
        while self.ended.is_none() && self.state.t < until {
            if let Err(cause) = self.advance_once(until) {
                self.ended = Some(cause);
            }
        }
        self.stats.evaluations = self.eval.count;
    }

    /// One accepted step, and the event it ends with, if any.
    fn advance_once(&mut self, until: f64) -> Result<(), EndCause> {
        let (h, grow) = self.attempt(until)?;
        let whole = self.state.t + h >= until;
        let (theta, event) = self.first_event()?;
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
        self.stats.steps += 1;
        self.monitor
            .watch(&self.model, &self.eval, &before, &self.state);
        match event {
            Some(Happening::Guard(guard)) => self.pass(guard),
            Some(Happening::Sample) => {
                sample(&self.model, &mut self.state, self.eval.kin.angle[FREE_FOOT]);
                self.resume()
            }
            None => Ok(()),
        }
    }

    /// Step from the present state until the error fits; returns the step size and the next one.
    fn attempt(&mut self, until: f64) -> Result<(f64, f64), EndCause> {
        let tolerance = self.model.scene.accuracy.tolerance();
        let state = &self.state;
        let left = until - state.t;
        let mut h = state.h.min(LONGEST);
        let mut y = [0.0; NY];
        y[..NV].copy_from_slice(&state.q);
        y[NV..POWERS].copy_from_slice(&state.v);
        let ledger = &state.ledger;
        y[POWERS..].copy_from_slice(&[ledger.actuators, ledger.damping, ledger.friction]);
        loop {
            let wanted = h;
            // Never leave a sliver for the next step.
            if h > left * (1.0 - 1e-9) {
                h = left;
            } else if h > 0.5 * left {
                h = 0.5 * left;
            }
            let mut flow = RobotFlow {
                model: &self.model,
                eval: &mut self.eval,
                frozen: Frozen::of(&self.state, &self.residual),
            };
            let done = self
                .step
                .attempt(&mut flow, (self.state.t, &y, &self.dy), h);
            let error = match done {
                Ok(()) => self.step.error(tolerance, &SCALE),
                Err(_) => f64::INFINITY,
            };
            if error <= 1.0 {
                let next = h * step_factor(error);
                return Ok((h, if h < wanted { next.max(wanted) } else { next }));
            }
            self.stats.rejections += 1;
            h *= if error.is_finite() {
                step_factor(error).min(0.9)
            } else {
                0.1
            };
            if h < SHORTEST {
                return Err(done.err().unwrap_or(EndCause::StepLimit));
            }
        }
    }

    /// The first thing that happens inside the attempted step, and when, as a fraction of it.
    fn first_event(&mut self) -> Result<(f64, Option<Happening>), EndCause> {
        let mut theta = 1.0;
        let mut event = None;
        self.step.make_dense();
        if let Some(at) = self.first_switch() {
            (theta, event) = (at, Some(Happening::Sample));
        }
        let mut ends = [0.0; MOST];
        let guards = self.guards;
        if theta < 1.0 {
            self.look(theta)?;
        }
        self.guard_values(theta, &mut ends);
        for (i, &guard) in guards.as_slice().iter().enumerate() {
            let sign = if guard.counts_both_ways(&self.model) {
                self.values[i].signum()
            } else {
                1.0
            };
            let (start, end) = (sign * self.values[i], sign * ends[i]);
            if !(start > 0.0 && end <= 0.0) {
                continue;
            }
            let root = self.locate((guard, sign), start, (theta, end))?;
            if root < theta || event.is_none() {
                (theta, event) = (root, Some(Happening::Guard(guard)));
                self.look(theta)?;
                self.guard_values(theta, &mut ends);
            }
        }
        Ok((theta, event))
    }

    /// Evaluate at a fraction of the attempted step.
    fn look(&mut self, theta: f64) -> Result<(), EndCause> {
        let y = self.step.at(theta);
        let (q, v) = unpack(&y);
        let mut frozen = Frozen::of(&self.state, &self.residual);
        frozen.now.t = self.step.t + theta * self.step.h;
        self.eval.accelerations(&self.model, q, v, &frozen)
    }

    fn guard_values(&self, theta: f64, out: &mut [f64; MOST]) {
        let at = if theta < 1.0 {
            (
                self.step.component(1, theta),
                self.step.component(NV, theta),
            )
        } else {
            (self.step.y1[1], self.step.y1[NV])
        };
        for (i, guard) in self.guards.as_slice().iter().enumerate() {
            out[i] = guard.value(&self.model, &self.eval, self.state.mode, at);
        }
    }

    /// The first sample inside the step at which the clock changes, as a fraction of it.
    fn first_switch(&self) -> Option<f64> {
        let period = self.model.scene.control.sample_period;
        let (start, h) = (self.step.t, self.step.h);
        // Ticks in (start, start + h], where the ends may be ticks themselves but for rounding.
        let mut tick = (start / period).floor();
        loop {
            let theta = (tick * period - start) / h;
            if theta > 1.0 + TICK_ROUNDING / h {
                return None;
            }
            if theta > TICK_ROUNDING / h {
                let theta = theta.min(1.0);
                // The free foot's angle is the sum along the chain from the supporting foot.
                let angle = (2..=Evaluation::Q7)
                    .map(|i| self.step.component(i, theta))
                    .sum();
                if sampled(&self.model, &self.state, angle) != self.state.clock {
                    return Some(theta);
                }
            }
            tick += 1.0;
        }
    }

    /// Root of `sign` times a guard in (0, theta] by the Illinois method (Dowell and Jarratt 1971); the
    /// end where it is not positive.
    fn locate(
        &mut self,
        (guard, sign): (Guard, f64),
        at_start: f64,
        (theta, at_end): (f64, f64),
    ) -> Result<f64, EndCause> {
        let (mut a, mut ga, mut b, mut gb) = (0.0, at_start, theta, at_end);
        let mut side = 0;
        while (b - a) * self.step.h > EVENT_TIME {
            self.stats.root_iterations += 1;
            let mut c = (a * gb - b * ga) / (gb - ga);
            // Keep clear of the ends, where rounding would stall the bracket.
            let margin = 0.25 * EVENT_TIME / self.step.h;
            c = c.clamp(a + margin, b - margin);
            self.look(c)?;
            let at = (self.step.component(1, c), self.step.component(NV, c));
            let value = guard.value(&self.model, &self.eval, self.state.mode, at);
            let g = sign * value;
            if g > 0.0 {
                (a, ga) = (c, g);
                if side == 1 {
                    gb *= 0.5;
                }
                side = 1;
            } else {
                (b, gb) = (c, g);
                if side == -1 {
                    ga *= 0.5;
                }
                side = -1;
            }
        }
        Ok(b)
    }

    fn take(&mut self, y: &[f64; NY], t: f64) {
        let (q, v) = unpack(y);
        (self.state.q, self.state.v) = (*q, *v);
        self.state.t = t;
        let ledger = &mut self.state.ledger;
        [ledger.actuators, ledger.damping, ledger.friction] =
            [y[POWERS], y[POWERS + 1], y[POWERS + 2]];
    }

    /// Evaluate at the state and read the guards.
    pub(crate) fn begin_mode(&mut self) -> Result<(), EndCause> {
        let mut y = [0.0; NY];
        y[..NV].copy_from_slice(&self.state.q);
        y[NV..POWERS].copy_from_slice(&self.state.v);
        let mut flow = RobotFlow {
            model: &self.model,
            eval: &mut self.eval,
            frozen: Frozen::of(&self.state, &self.residual),
        };
        flow.rhs(self.state.t, &y, &mut self.dy)?;
        self.guards = Guards::of(&self.model, self.state.mode);
        self.read_guards();
        Ok(())
    }

    fn read_guards(&mut self) {
        let at = (self.state.q[1], self.state.v[0]);
        for (i, guard) in self.guards.as_slice().iter().enumerate() {
            self.values[i] = guard.value(&self.model, &self.eval, self.state.mode, at);
        }
    }

    /// Pass an event, and whatever follows from it at the same instant.
    fn pass(&mut self, first: Guard) -> Result<(), EndCause> {
        let mut next = Some(first);
        while let Some(guard) = next {
            self.count_event()?;
            let passed = guard;
            let from = self.state.mode;
            let leg = self.state.support_leg;
            self.passage().through(guard)?;
            if self.state.mode.free.touch != Touch::Air {
                let (q, v) = (self.state.q, self.state.v);
                self.eval
                    .move_to(&self.model, self.state.mode.support.touch, &q, &v);
                self.eval.assemble(&self.model, self.state.mode.free.touch);
                project(&self.model, &mut self.eval, &mut self.state)?;
            }
            self.begin_mode()?;
            if (self.state.mode, self.state.support_leg) != (from, leg) {
                self.events.push(Event {
                    t: self.state.t,
                    what: guard.describe(),
                    from,
                    to: self.state.mode,
                    leg: self.state.support_leg,
                });
            }
            if self.state.support_leg != leg {
                if self.model.scene.contact.law == ContactLaw::TwoWay {
                    // The paper's swap is the controller's own event; it counts t0 from there.
                    sample(&self.model, &mut self.state, self.eval.kin.angle[FREE_FOOT]);
                    self.begin_mode()?;
                }
                self.records.push(self.monitor.current);
                self.monitor = Monitor::new(&self.model, &self.state, &self.eval);
            }
            next = self.due_at_once().filter(|&guard| {
                (guard, self.state.mode, self.state.support_leg) != (passed, from, leg)
            });
        }
        self.state.h = self.state.h.min(1e-3);
        Ok(())
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

    fn count_event(&mut self) -> Result<(), EndCause> {
        self.stats.events += 1;
        if self.state.t - self.crowd.0 > CROWD_TIME {
            self.crowd = (self.state.t, 0);
        }
        self.crowd.1 += 1;
        if self.crowd.1 > CROWD {
            Err(EndCause::StepLimit)
        } else {
            Ok(())
        }
    }

    /// An evaluation that knows all bodies at the present state, for energy, momentum and drawing: a
    /// step leaves the arms' place in the world out.
    pub fn survey(&self) -> Evaluation {
        let mut eval = self.eval.clone();
        let State { q, v, mode, .. } = &self.state;
        eval.survey(&self.model, mode.support.touch, q, v);
        eval
    }

    /// Events since the last call.
    pub fn take_events(&mut self) -> Vec<Event> {
        std::mem::take(&mut self.events)
    }

    /// Steps completed since the last call.
    pub fn take_records(&mut self) -> Vec<StepRecord> {
        std::mem::take(&mut self.records)
    }
}

/// How deep a foot may start below the ice [m].
const START_DEPTH: f64 = 1e-9;

/// What ends a step early.
#[derive(Debug, Clone, Copy)]
enum Happening {
    Guard(Guard),
    /// The controller samples another law, or Eq. 21 switches.
    Sample,
}
