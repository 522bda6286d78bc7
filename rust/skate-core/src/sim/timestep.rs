//! Time-stepping after Moreau (1988): steps of fixed length in which contacts act by impulses.
//!
//! A step is evaluated once, at the middle of the way that the old velocities would take. Feet stick,
//! slip and let go by the signs of impulses and new velocities, at the step's ends; only landings are
//! located inside it. The friction of the joints acts on the mean of old and new velocities:
//! M + h/2 D takes the place of M.

use super::{Simulation, TICK_ROUNDING};
use crate::{
    contact::{
        Mode, Solution, Touch, Y,
        select::{Question, Tolerance, consistent, select, slip},
    },
    control::{
        lifting::{head_feedback, head_jacobian},
        sampled,
    },
    error::EndCause,
    evaluate::Frozen,
    guards::{Guard, Guards, MOST},
    model::{FREE_FOOT, NV},
    project::project_positions,
    scene::ContactLaw,
    state::State,
    transition::touches,
};
use nalgebra::Vector3;

/// How often a step may begin anew because contacts have changed.
const CHANGES: u32 = 8;
/// An end this far below the ice has landed [m].
const DEPTH: f64 = 1e-6;
/// A landing is located to this [m], with as many trials at most.
const LANDED: f64 = 1e-5;
const TRIALS: u32 = 6;
/// Solutions for the new velocities: the second knows their mean.
const PASSES: u32 = 2;

impl Simulation {
    /// One step, or a part of it that ends with a landing. `eval` knows where the bodies are.
    pub(super) fn time_step(&mut self, step: f64, until: f64) -> Result<(), EndCause> {
        self.count_step()?;
        let left = until - self.state.t;
        let mut h = left / (left / step - 1e-9).ceil();
        let tick = self.tick();
        let angle = self.eval.kin.angle[FREE_FOOT];
        if sampled(&self.model, &self.state, angle) != self.state.clock {
            // The controller will notice at its next sample.
            h = h.min((tick + 1.0) * self.model.scene.control.sample_period - self.state.t);
        }
        let event = self.settle_contacts(h)?;
        if event.is_none() && h == left {
            self.state.t = until;
        }
        let fallen = Guard::Fall.value(&self.model, &self.eval, self.state.mode, self.pivot());
        if self.model.scene.fall.is_some() && fallen <= 0.0 {
            return Err(EndCause::Fall);
        }
        if let Some(guard) = event {
            self.land(guard)?;
        }
        if self.tick() > tick {
            self.sample();
        }
        Ok(())
    }

    /// Move by `h` in the contact state that the impulses are consistent with, or by less, up to a
    /// landing.
    fn settle_contacts(&mut self, h: f64) -> Result<Option<Guard>, EndCause> {
        let near = self.state.mode;
        if self.model.scene.contact.law == ContactLaw::PushOnly {
            self.close_ends()?;
        }
        let mut decided = false;
        for change in 1.. {
            let start = self.state;
            let heights = self.heights();
            let mode = self.glide(&start, h, near, decided)?;
            if touches(mode) != touches(start.mode) {
                self.state = start;
                self.passage().open(mode);
                self.arrive("an end of a sole lifts", &start)?;
                decided = true;
                continue;
            }
            if let Some(guard) = self.released(start.mode)
                && change < CHANGES
            {
                if self.locate_release(&start, h, guard, near)? {
                    self.monitor
                        .watch(&self.model, &self.eval, &start, &self.state);
                    return Ok(Some(guard));
                }
                self.state = start;
                self.passage().through(guard)?;
                self.arrive(guard.describe(), &start)?;
                continue;
            }
            let mut landing = self.landing(&heights);
            if let Some((guard, low)) = landing
                && !self.locate_landing(&start, h, (guard, low), (near, decided))?
            {
                // It lands where the step begins.
                if self.model.scene.contact.law == ContactLaw::TwoWay && change < CHANGES {
                    self.state = start;
                    let State { q, v, mode, .. } = &start;
                    self.eval.move_planar(&self.model, *mode, q, v);
                    self.land(guard)?;
                    continue;
                }
                self.glide(&start, h, near, decided)?;
                landing = None;
            }
            self.monitor
                .watch(&self.model, &self.eval, &start, &self.state);
            return Ok(landing.map(|(guard, _)| guard));
        }
        unreachable!("the loop returns")
    }

    /// Push-only: all ends on the ice may act, and those below it land.
    fn close_ends(&mut self) -> Result<(), EndCause> {
        let mode = self.state.mode;
        let gaps = self
            .eval
            .gaps(&self.model, mode.support.touch, self.state.q[1]);
        let touch = |foot: usize| Touch::of(gaps[foot][0] <= DEPTH, gaps[foot][1] <= DEPTH);
        let free = match self.model.scene.contact.free_foot {
            true => touch(1),
            false => Touch::Air,
        };
        if (touch(0), free) != touches(mode) {
            let before = self.state;
            self.passage().close((touch(0), free))?;
            self.arrive("an end of a sole touches", &before)?;
        }
        Ok(())
    }

    /// Pass a landing at the present state.
    fn land(&mut self, guard: Guard) -> Result<(), EndCause> {
        let before = self.state;
        self.passage().land(guard)?;
        self.arrive(guard.describe(), &before)
    }

    /// The controller's last sample, counted from t = 0.
    fn tick(&self) -> f64 {
        ((self.state.t + TICK_ROUNDING) / self.model.scene.control.sample_period).floor()
    }

    /// Height and velocity of the pivot.
    fn pivot(&self) -> (f64, f64) {
        (self.state.q[1], self.state.v[0])
    }

    /// The state has passed an event: find the bodies, and remember it.
    fn arrive(&mut self, what: &'static str, before: &State) -> Result<(), EndCause> {
        self.count_event()?;
        let State { q, v, mode, .. } = &self.state;
        self.eval.move_planar(&self.model, *mode, q, v);
        self.note(what, before.mode, before.support_leg);
        Ok(())
    }

    /// Guards of landings, at the present state.
    fn heights(&mut self) -> [f64; MOST] {
        let mut heights = [f64::NAN; MOST];
        self.guards = Guards::of(&self.model, self.state.mode);
        for (i, guard) in self.guards.as_slice().iter().enumerate() {
            if matches!(guard, Guard::Gap(..)) {
                heights[i] = guard.value(&self.model, &self.eval, self.state.mode, self.pivot());
            }
        }
        heights
    }

    /// Two-way contact: the end of a sole that the ice would have to hold down, and that may let go.
    fn released(&self, mode: Mode) -> Option<Guard> {
        if self.model.scene.contact.law == ContactLaw::PushOnly {
            return None;
        }
        let guards = self.guards.as_slice().iter();
        guards.copied().find(|guard| {
            matches!(guard, Guard::Load(..))
                && guard.value(&self.model, &self.eval, mode, self.pivot()) < 0.0
        })
    }

    /// The end that comes down first since the heights were taken, and how high it was, by straight
    /// lines.
    fn landing(&self, heights: &[f64; MOST]) -> Option<(Guard, f64)> {
        let push_only = self.model.scene.contact.law == ContactLaw::PushOnly;
        let mut first: Option<(f64, Guard, f64)> = None;
        for (i, &guard) in self.guards.as_slice().iter().enumerate() {
            let start = heights[i];
            if start.is_nan() {
                continue;
            }
            let end = guard.value(&self.model, &self.eval, self.state.mode, self.pivot());
            let sign = if guard.counts_both_ways(&self.model) {
                start.signum()
            } else {
                1.0
            };
            let (start, end) = (sign * start, sign * end);
            if end < -DEPTH && end < start && (start > -DEPTH || push_only) {
                let theta = start.max(0.0) / (start - end);
                if first.is_none_or(|(least, ..)| theta < least) {
                    first = Some((theta, guard, start));
                }
            }
        }
        first.map(|(_, guard, start)| (guard, start))
    }

    /// Shorten the step so that it ends with a landing; false if it would begin with it.
    fn locate_landing(
        &mut self,
        start: &State,
        h: f64,
        (guard, at_start): (Guard, f64),
        (near, decided): (Mode, bool),
    ) -> Result<bool, EndCause> {
        let value = |sim: &Self| guard.value(&sim.model, &sim.eval, sim.state.mode, sim.pivot());
        let at_end = value(self);
        let sign = if at_end > 0.0 { -1.0 } else { 1.0 };
        let (mut a, mut ga, mut b, mut gb) = (0.0, at_start.max(0.0), h, sign * at_end);
        for _ in 0..TRIALS {
            let now = (a * gb - b * ga) / (gb - ga);
            if now <= 0.01 * h {
                return Ok(false);
            }
            self.stats.root_iterations += 1;
            self.glide(start, now, near, decided)?;
            let g = sign * value(self);
            if g.abs() < LANDED {
                break;
            }
            if g > 0.0 {
                (a, ga, gb) = (now, g, 0.5 * gb);
            } else {
                (b, gb, ga) = (now, g, 0.5 * ga);
            }
        }
        Ok(true)
    }

    /// Shorten the step so that it ends where a foot lets go, by a straight line through the mean forces
    /// of this step and of its half; false if that is not after its start.
    fn locate_release(
        &mut self,
        start: &State,
        h: f64,
        guard: Guard,
        near: Mode,
    ) -> Result<bool, EndCause> {
        let force = |sim: &Self| guard.value(&sim.model, &sim.eval, start.mode, (0.0, 0.0));
        let whole = force(self);
        self.glide(start, 0.5 * h, near, false)?;
        let half = force(self);
        let at = 0.25 * h * (1.0 + half / (half - whole));
        if half <= whole || at <= 0.01 * h {
            return Ok(false);
        }
        self.glide(start, at.min(h), near, false)?;
        Ok(true)
    }

    /// Move from `start` by `h` and return the mode that the impulses are consistent with. If it has
    /// other touches than the start's, nothing has moved.
    fn glide(
        &mut self,
        start: &State,
        h: f64,
        near: Mode,
        decided: bool,
    ) -> Result<Mode, EndCause> {
        let (model, eval) = (&self.model, &mut self.eval);
        let n = model.n.min(NV);
        let free = start.mode.free.touch;
        let mut q = start.q;
        for c in 0..n {
            q[c] += 0.5 * h * start.v[c];
        }
        let mut frozen = Frozen::of(model, start, &self.residual);
        frozen.now.t = start.t + 0.5 * h;
        eval.count += 1;
        eval.step_to(model, start.mode.support.touch, &q, &start.v);
        eval.assemble_with(model, free, 0.5 * h);
        let feedback = head_feedback(model, &frozen.now).map(|[K, D]| {
            let J = head_jacobian(model, &eval.kin, &frozen.now);
            (J, 0.25 * h * h * K, 0.5 * h * D)
        });
        if let Some((J, stiffness, damping)) = &feedback {
            eval.factored.stiffen(model, free, J, stiffness + damping)?;
        }
        let foot = eval.point_velocity[Y];
        let question = Question {
            closed: [start.mode.support.touch, free],
            moving: [None, None],
            caught: None,
            near,
            not: None,
            tolerance: Tolerance {
                force: 1e-9,
                motion: 1e-11,
            },
        };
        let mut mean = start.v;
        let mut end = (start.mode, Solution::default());
        let mut v = start.v;
        for pass in 0..PASSES {
            if pass > 0 {
                for c in 0..n {
                    mean[c] = 0.5 * (start.v[c] + v[c]);
                }
                eval.kin.planar_velocities(model, &mean);
            }
            eval.apply_torques(model, &q, &mean, &frozen);
            if let Some((J, _, damping)) = &feedback {
                // The torques have the damping of the first pass; the springs count it from the start.
                for (J, damping) in J.iter().zip(damping) {
                    let moved: f64 = (0..n).map(|c| J[c] * (v[c] - start.v[c])).sum();
                    for c in 0..n {
                        eval.tau[c] += J[c] * damping * moved / h;
                    }
                }
            }
            eval.load_momentum(model, free, (&start.v, &mean), h);
            let problem = &eval.factored.problem;
            let stay = || Ok((start.mode, problem.solve(start.mode, slip(model, start.mode))?));
            end = if decided {
                stay()?
            } else if let Some(solution) = consistent(model, problem, &question, start.mode)? {
                (start.mode, solution)
            } else {
                match select(model, problem, &question) {
                    Err(EndCause::Jam) => stay()?,
                    found => found?,
                }
            };
            if touches(end.0) != touches(start.mode) {
                return Ok(end.0);
            }
            let change = eval.change(model, free, &start.v, &end.1);
            for c in 0..n {
                v[c] = if c < 3 { end.1.a_root[c] } else { start.v[c] + change[c] };
            }
        }
        let (mode, solution) = end;
        self.state = *start;
        let state = &mut self.state;
        for c in 0..n {
            state.v[c] = v[c];
            state.q[c] = q[c] + 0.5 * h * state.v[c];
        }
        state.t = start.t + h;
        if !state.v[..n].iter().map(|v| v * 0.0).sum::<f64>().is_finite() {
            return Err(EndCause::NotFinite);
        }
        if model.scene.ledger {
            let ledger = &mut state.ledger;
            for c in 0..n {
                let mean = 0.5 * (start.v[c] + state.v[c]);
                let damped = h * model.damping[c] * mean * mean;
                ledger.actuators += h * eval.tau[c] * mean;
                if c == 0 {
                    ledger.friction += damped;
                } else {
                    ledger.damping += damped;
                }
            }
            ledger.friction -= 0.5 * solution.f_root[Y] * (start.v[0] + state.v[0]);
            ledger.friction -= 0.5 * solution.lam[Y] * (foot + solution.a_free[Y]);
        }
        eval.move_planar(model, mode, &state.q, &state.v);
        if mode.free.touch != Touch::Air {
            let newly = !mode.free.slides() && mode.free != start.mode.free;
            state.mode = mode;
            if newly {
                self.passage().set_anchor();
            }
            project_positions(&self.model, &mut self.eval, &mut self.state)?;
        }
        let per = 1.0 / h;
        let root = Vector3::new(start.v[0], start.v[1], start.v[2]);
        self.eval.solution = Solution {
            a_root: (solution.a_root - root) * per,
            f_root: solution.f_root * per,
            a_free: Vector3::zeros(),
            lam: solution.lam * per,
        };
        if mode != start.mode {
            self.state.mode = mode;
        }
        Ok(mode)
    }
}
