//! Landings and releases inside a step.

use super::{super::Simulation, DEPTH, glide::Freedom};
use crate::{
    error::EndCause,
    guards::{Guard, MOST},
    scene::ContactLaw,
    state::State,
};

/// A landing is located to this [m], with as many trials at most.
const LANDED: f64 = 1e-5;
const TRIALS: usize = 6;
/// What happens in this share of a step happens at its start.
const AT_ONCE: f64 = 0.01;

impl Simulation {
    /// The end that comes down first since the heights were taken, and how high it was, by straight
    /// lines.
    pub(super) fn landing(&self, heights: &[f64; MOST]) -> Option<(Guard, f64)> {
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
    pub(super) fn locate_landing(
        &mut self,
        start: &State,
        h: f64,
        (guard, at_start): (Guard, f64),
        freedom: Freedom,
    ) -> Result<bool, EndCause> {
        let value = |sim: &Self| guard.value(&sim.model, &sim.eval, sim.state.mode, sim.pivot());
        let at_end = value(self);
        let sign = if at_end > 0.0 { -1.0 } else { 1.0 };
        let (mut a, mut ga, mut b, mut gb) = (0.0, at_start.max(0.0), h, sign * at_end);
        for _ in 0..TRIALS {
            let now = (a * gb - b * ga) / (gb - ga);
            if now <= AT_ONCE * h {
                return Ok(false);
            }
            self.stats.root_iterations += 1;
            self.glide(start, now, freedom)?;
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
    pub(super) fn locate_release(
        &mut self,
        start: &State,
        h: f64,
        guard: Guard,
        freedom: Freedom,
    ) -> Result<bool, EndCause> {
        let force = |sim: &Self| guard.value(&sim.model, &sim.eval, start.mode, (0.0, 0.0));
        let whole = force(self);
        self.glide(start, 0.5 * h, freedom)?;
        let half = force(self);
        let at = 0.25 * h * (1.0 + half / (half - whole));
        if half <= whole || at <= AT_ONCE * h {
            return Ok(false);
        }
        self.glide(start, at.min(h), freedom)?;
        Ok(true)
    }
}
