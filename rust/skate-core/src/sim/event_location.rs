//! Location of the first event inside a time step.

use crate::{
    control::sampled,
    error::Termination,
    events::{guard::Guard, guards::MAX_GUARDS},
    integrate::Method,
    model::{contact_mode::SoleContact, controller_state::tick_rounding},
    rhs::{Evaluation, StepContext},
    sim::{
        Simulation,
        guard_samples::Point,
        mode_system::unpack,
        trial::{EndPoint, Evaluated},
    },
};
use std::ops::RangeInclusive;

/// Tolerance of event times [s].
const EVENT_TIME: f64 = 1e-13;

/// Joint angles along the chain between the feet, whose sum is the free foot's angle to the ice.
const ANGLES: RangeInclusive<usize> = 2..=Evaluation::Q7;

/// Maximum number of evaluations in search of a guard's dip below zero.
const MAX_DIP_SAMPLES: usize = 10;

/// Minimum of the parabola through three points, of which `b` lies between the others, and the value there; None if
/// it coincides with one of them.
fn parabola_minimum(a: Point, b: Point, c: Point) -> Option<Point> {
    let slope = |from: Point, to: Point| (to.value - from.value) / (to.theta - from.theta);
    let (left, right) = (slope(a, b), slope(b, c));
    let bend = (right - left) / (c.theta - a.theta);
    let theta = 0.5 * (a.theta + b.theta - left / bend);
    let apart = 1e-3 * (c.theta - a.theta);
    let inside =
        theta > a.theta + apart && theta < c.theta - apart && (theta - b.theta).abs() > apart;
    let value = b.value + (theta - b.theta) * (left + bend * (theta - a.theta));
    inside.then_some(Point { theta, value })
}

/// A guard that is positive at `start`, after multiplication by `sign`.
#[derive(Debug, Clone, Copy)]
struct Watched {
    /// Index among the guards of the mode.
    index: usize,
    guard: Guard,
    sign: f64,
    start: Point,
}

/// Event that ends a step early.
#[derive(Debug, Clone, Copy)]
pub(super) enum StepEvent {
    Guard(Guard),
    /// A controller sample changes the active law, or Eq. 21 switches.
    Sample,
}

impl Simulation {
    /// The first event inside the attempted step and its time, as a fraction of the step. The last evaluation is there.
    ///
    /// `lanes` is the end of a step that was computed in lanes; without it `eval` is the evaluation there.
    pub(super) fn first_event(
        &mut self,
        method: Method,
        lanes: Option<&EndPoint<'_>>,
    ) -> Result<(f64, Option<StepEvent>), Termination> {
        let mut theta = 1.0;
        let mut event = None;
        if !method.dense_output_evaluates() {
            self.make_dense(method, lanes)?;
        }
        if let Some(at) = self.first_controller_change(method, lanes)? {
            (theta, event) = (at, Some(StepEvent::Sample));
        }
        let mut ends = [0.0; MAX_GUARDS];
        let guards = self.guards;
        match lanes {
            Some(end) if self.evaluated == Evaluated::EndInLanes => ends = end.guards,
            _ => {
                self.evaluate_at(theta)?;
                self.guard_values(theta, &mut ends);
            }
        }
        // Where a guard ends the step early, one that was checked before may be zero or negative.
        let mut again = false;
        loop {
            let checked_to = theta;
            for (i, &guard) in guards.as_slice().iter().enumerate() {
                if matches!(event, Some(StepEvent::Guard(found)) if found == guard) {
                    continue;
                }
                let sign = if guard.counts_both_ways(&self.model) {
                    self.values[i].signum()
                } else {
                    1.0
                };
                let at = |theta, value| Point {
                    theta,
                    value: sign * value,
                };
                let (start, end) = (at(0.0, self.values[i]), at(theta, ends[i]));
                let Some(start) = self.rise(method, lanes, (i, guard, sign), (start, end))? else {
                    continue;
                };
                let watched = Watched {
                    index: i,
                    guard,
                    sign,
                    start,
                };
                let below = if end.value <= 0.0 {
                    self.make_dense(method, lanes)?;
                    Some(end)
                } else if again {
                    None
                } else {
                    self.find_dip(method, lanes, &watched, end)?
                };
                let Some(below) = below else {
                    continue;
                };
                let root = self.find_root(&watched, below)?;
                // The same force may end a mode through two guards; the first in the list counts.
                if event.is_none() || root < theta - 2.0 * EVENT_TIME / self.step.h {
                    (theta, event) = (root, Some(StepEvent::Guard(guard)));
                    self.evaluate_at(theta)?;
                    self.guard_values(theta, &mut ends);
                }
            }
            if theta == checked_to {
                break;
            }
            again = true;
        }
        if event.is_some() || self.evaluated != Evaluated::EndInLanes {
            self.evaluate_at(theta)?;
        }
        Ok((theta, event))
    }

    /// A point before `end` from which a guard may fall through zero: the start, or if it is not positive there, as the
    /// speed of a foot that starts to slide, a later one at which it is.
    fn rise(
        &mut self,
        method: Method,
        lanes: Option<&EndPoint<'_>>,
        (index, guard, sign): (usize, Guard, f64),
        (start, end): (Point, Point),
    ) -> Result<Option<Point>, Termination> {
        if start.value > 0.0 {
            return Ok(Some(start));
        }
        if end.value > 0.0 {
            return Ok(None);
        }
        let samples = &self.guard_samples;
        let risen = |sample: &Point| sample.theta < end.theta && sign * sample.value > 0.0;
        if let Some(Point { theta, value }) = samples.of(index).find(risen) {
            let value = sign * value;
            return Ok(Some(Point { theta, value }));
        }
        let bottom = Point {
            value: -end.value,
            ..end
        };
        let Some(theta) = samples.find_dip(index, -sign, -start.value, bottom) else {
            return Ok(None);
        };
        self.make_dense(method, lanes)?;
        self.evaluate_for(guard, theta)?;
        let value = sign * self.guard_value(guard, theta);
        Ok((value > 0.0).then_some(Point { theta, value }))
    }

    /// A point before `end` at which a guard that is positive at both ends is zero or negative.
    fn find_dip(
        &mut self,
        method: Method,
        lanes: Option<&EndPoint<'_>>,
        watched: &Watched,
        end: Point,
    ) -> Result<Option<Point>, Termination> {
        let (guard, start) = (watched.guard, watched.start);
        if watched.sign < 0.0 {
            return Ok(None);
        }
        let samples = &self.guard_samples;
        let Some(mut theta) = samples.find_dip(watched.index, 1.0, start.value, end) else {
            return Ok(None);
        };
        self.make_dense(method, lanes)?;
        // Successive parabolic interpolation (Brent 1973, section 5.2) between a and b.
        let (mut a, mut b) = (start, end);
        let mut least: Option<Point> = None;
        for _ in 0..MAX_DIP_SAMPLES {
            self.evaluate_for(guard, theta)?;
            let value = self.guard_value(guard, theta);
            let new = Point { theta, value };
            if value <= 0.0 {
                return Ok(Some(new));
            }
            let middle = match least {
                None => new,
                Some(old) => {
                    let (lower, higher) = if new.value < old.value {
                        (new, old)
                    } else {
                        (old, new)
                    };
                    let before = higher.theta < lower.theta;
                    *(if before { &mut a } else { &mut b }) = higher;
                    lower
                }
            };
            least = Some(middle);
            match parabola_minimum(a, middle, b) {
                // A parabola is not wrong by more than half of the value.
                Some(next) if next.value < 0.5 * middle.value => theta = next.theta,
                _ => break,
            }
        }
        self.evaluate_at(end.theta)?;
        Ok(None)
    }

    /// Make the method's dense output of the attempted step, if it is not made. This may evaluate the dynamics inside the
    /// step.
    fn make_dense(
        &mut self,
        method: Method,
        lanes: Option<&EndPoint<'_>>,
    ) -> Result<(), Termination> {
        if self.step.is_dense() {
            return Ok(());
        }
        if let Some(end) = lanes {
            (end.copy_slopes)(&mut self.step);
        }
        if method.dense_output_evaluates() {
            self.evaluated = Evaluated::Elsewhere;
        }
        let (step, mut system) = self.mode_system();
        step.make_dense(method, &mut system)
    }

    /// Evaluate at the end of the step if only the lanes have done so.
    pub(crate) fn complete_evaluation(&mut self) -> Result<(), Termination> {
        if self.evaluated != Evaluated::EndInLanes {
            return Ok(());
        }
        let count = self.eval.count;
        self.evaluated = Evaluated::Elsewhere;
        let done = self.evaluate_at(1.0);
        self.eval.count = count;
        done
    }

    /// Evaluate the dynamics at a fraction of the attempted step, if the last evaluation was not there.
    fn evaluate_at(&mut self, theta: f64) -> Result<(), Termination> {
        match self.evaluated {
            Evaluated::At(at) if at == theta => return Ok(()),
            Evaluated::EndInLanes if theta == 1.0 => return self.complete_evaluation(),
            _ => self.evaluated = Evaluated::At(theta),
        }
        let y = if theta < 1.0 {
            self.step.at(theta)
        } else {
            self.step.y1
        };
        let (q, v) = unpack(&y, self.model.n);
        let mut context = StepContext::of(&self.model, &self.state, &self.residual);
        context.now.t = self.step.t + theta * self.step.h;
        self.eval.accelerations(&self.model, q, v, &context)
    }

    /// Evaluate what a guard needs at a fraction of the attempted step: for some guards not the forces.
    fn evaluate_for(&mut self, guard: Guard, theta: f64) -> Result<(), Termination> {
        if !guard.is_kinematic() || self.evaluated == Evaluated::At(theta) {
            return self.evaluate_at(theta);
        }
        self.evaluated = Evaluated::Elsewhere;
        let y = self.step.at(theta);
        let (q, v) = unpack(&y, self.model.n);
        self.eval
            .set_planar_configuration(&self.model, self.state.mode, q, v);
        Ok(())
    }

    fn guard_values(&self, theta: f64, out: &mut [f64; MAX_GUARDS]) {
        for (i, guard) in self.guards.as_slice().iter().enumerate() {
            out[i] = self.guard_value(*guard, theta);
        }
    }

    /// Guard value at the fraction of the step at which `eval` was evaluated.
    fn guard_value(&self, guard: Guard, theta: f64) -> f64 {
        let n = self.model.n;
        let at = if theta < 1.0 {
            (self.step.component(1, theta), self.step.component(n, theta))
        } else {
            (self.step.y1[1], self.step.y1[n])
        };
        guard.value(&*self.model, &self.eval, self.state.mode, at)
    }

    /// The first controller sample inside the step that changes the controller state, as a fraction of the
    /// step.
    fn first_controller_change(
        &mut self,
        method: Method,
        lanes: Option<&EndPoint<'_>>,
    ) -> Result<Option<f64>, Termination> {
        if self.model.controller_terms.is_empty() {
            return Ok(None);
        }
        let period = self.model.scene.control.sample_period;
        let (start, h) = (self.step.t, self.step.h);
        if !self.step.is_dense() {
            self.step.cubic(ANGLES);
        }
        // Sample times in (start, start + h]; up to rounding, the ends may be sample times themselves.
        let (mut tick, rounding) = ((start / period).floor(), tick_rounding(start));
        loop {
            // Not as a fraction of the step: for a step of 1e-320 s it overflows and the loop does not
            // terminate.
            let ahead = tick * period - start;
            if ahead > h + rounding {
                return Ok(None);
            }
            if ahead > rounding {
                let theta = (ahead / h).min(1.0);
                if !self.step.is_dense() && self.may_change(theta) {
                    self.make_dense(method, lanes)?;
                }
                if self.changes(self.free_foot_angle(theta)) {
                    return Ok(Some(theta));
                }
            }
            tick += 1.0;
        }
    }

    /// Does a sample with this angle of the free foot [rad] change the controller state?
    fn changes(&self, angle: f64) -> bool {
        sampled(&self.model, &self.state, angle) != self.state.controller
    }

    /// Could a sample change the controller state by the method's dense output? The angle of the present
    /// output is uncertain by its bend, except that of a flat foot, which is zero.
    fn may_change(&self, theta: f64) -> bool {
        let angle = self.free_foot_angle(theta);
        let bend = match self.state.mode.free.touch {
            SoleContact::Flat => 0.0,
            _ => self.step.bend(ANGLES),
        };
        [angle - bend, angle, angle + bend]
            .iter()
            .any(|&angle| self.changes(angle))
    }

    /// Angle of the free foot to the ice at a fraction of the attempted step [rad].
    pub(super) fn free_foot_angle(&self, theta: f64) -> f64 {
        ANGLES.map(|i| self.step.component(i, theta)).sum()
    }

    /// Root of a guard up to the point `below`, at which it is not positive, by the Illinois method (Dowell and Jarratt
    /// 1971). Returns the end of the bracket at which the value is not positive.
    fn find_root(&mut self, watched: &Watched, below: Point) -> Result<f64, Termination> {
        let &Watched {
            guard, sign, start, ..
        } = watched;
        let (mut a, mut ga) = (start.theta, start.value);
        let (mut b, mut gb) = (below.theta, below.value);
        let mut side = 0;
        while (b - a) * self.step.h > EVENT_TIME {
            self.stats.root_iterations += 1;
            let mut c = (a * gb - b * ga) / (gb - ga);
            // Stay away from the ends, where rounding stalls the bracket.
            let margin = 0.25 * EVENT_TIME / self.step.h;
            c = c.clamp(a + margin, b - margin);
            self.evaluate_for(guard, c)?;
            let g = sign * self.guard_value(guard, c);
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
}
