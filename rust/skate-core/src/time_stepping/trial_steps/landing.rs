//! Landings: the first end of a sole that reaches the ice within a step, and its time. The height is interpolated by
//! a cubic Hermite polynomial; each iteration steps to its zero.

use crate::{
    error::Termination,
    events::guard::{GAP_TOLERANCE, Guard},
    rhs::sole_points::SolePoints,
    sim::Simulation,
    time_stepping::{
        step_length::SHORTEST,
        trial_steps::{MAX_RESTARTS, Progress, START_FRACTION, Trial, TrialSteps},
    },
};

/// Depth below the ice at which an end has landed [m], in full steps of `STEP` [s] and longer ones. The depth is
/// proportional to the square of a shorter step, as the error of the method, down to `LEAST_DEPTH` [m].
const LANDING_DEPTH: f64 = 1e-6;
const STEP: f64 = 5e-3;
const LEAST_DEPTH: f64 = 1e-9;
/// Tolerance of the height at a landing, as a multiple of that depth, and the maximum number of trial steps to locate it.
const LANDING_TOLERANCE: f64 = 10.0;
pub(super) const MAX_LANDING_TRIALS: usize = 6;
/// Depth below the ice to which a step may go on without a landing [m].
const DEEPEST: f64 = 1e-4;
/// Newton iterations for the zero of a cubic, started from the linear interpolation.
const NEWTON: usize = 6;

/// Height of an end of a sole above the ice at a time after the start of the step, and its rate.
#[derive(Debug, Clone, Copy)]
pub(super) struct Height {
    t: f64,
    pub gap: f64,
    rate: f64,
}

impl Height {
    /// Height of the end that a guard watches; `sign` is -1 for an end that comes from below.
    pub fn of(sole_points: &SolePoints, guard: Guard, sign: f64, t: f64) -> Self {
        let (gap, rate) = match guard {
            Guard::Gap(which, end) => (
                sole_points.gap(which, end) + GAP_TOLERANCE,
                sole_points.speeds[which][end as usize][1],
            ),
            _ => (f64::INFINITY, 0.0),
        };
        Self {
            t,
            gap: sign * gap,
            rate: sign * rate,
        }
    }

    /// Zero of the linear interpolation between this height, above the ice, and a later one below it.
    fn linear_zero(self, below: Self) -> f64 {
        self.t + (below.t - self.t) * self.gap / (self.gap - below.gap)
    }

    /// Zero of the cubic Hermite interpolation, by Newton's method safeguarded by bisection.
    fn cubic_zero(self, below: Self) -> f64 {
        let length = below.t - self.t;
        let (rate, rate_below) = (length * self.rate, length * below.rate);
        let fall = below.gap - self.gap;
        let (square, cube) = (
            3.0 * fall - 2.0 * rate - rate_below,
            rate + rate_below - 2.0 * fall,
        );
        let (mut early, mut late) = (0.0, 1.0);
        let mut x = self.gap / -fall;
        for _ in 0..NEWTON {
            let value = self.gap + x * (rate + x * (square + x * cube));
            if value > 0.0 {
                early = x;
            } else {
                late = x;
            }
            let next = x - value / (rate + x * (2.0 * square + x * 3.0 * cube));
            x = if next >= early && next <= late {
                next
            } else {
                0.5 * (early + late)
            };
        }
        self.t + x * length
    }
}

/// A landing between two heights, which are multiplied by `sign`, the sign of the height at the start of the step.
#[derive(Debug, Clone, Copy)]
pub(super) struct Landing {
    pub guard: Guard,
    pub sign: f64,
    /// Above and below the ice.
    pub a: Height,
    pub b: Height,
    pub trials_left: usize,
}

impl TrialSteps {
    /// Depth below the ice at which an end has landed [m].
    fn landing_depth(&self) -> f64 {
        let share = self.full_length / STEP;
        (LANDING_DEPTH * (share * share).min(1.0)).max(LEAST_DEPTH)
    }

    /// The first end but `known` to land within the step, by linear interpolation, and the sign of its height at the start.
    pub(super) fn first_landing(
        &self,
        sim: &Simulation,
        known: Option<Guard>,
    ) -> Option<(Guard, f64)> {
        let (push_only, depth) = (sim.model.contact.is_push_only, self.landing_depth());
        let mut first: Option<(f64, Guard, f64)> = None;
        for &guard in self.guards.as_slice() {
            let Guard::Gap(which, end) = guard else {
                continue;
            };
            if known == Some(guard) {
                continue;
            }
            let start = self.sole_points.gap(which, end) + GAP_TOLERANCE;
            let end = sim.sole_points.gap(which, end) + GAP_TOLERANCE;
            // An end that may come from both sides lands before it reaches the ice: on the ice, its side would be
            // lost.
            let from_both = guard.counts_both_ways(&sim.model) && start.abs() > depth;
            let (sign, limit) = match from_both {
                true => (start.signum(), depth),
                false => (1.0, -depth),
            };
            let (start, end) = (sign * start, sign * end);
            let was_above = start > -LANDING_TOLERANCE * depth;
            if end < limit && end < start && (was_above || push_only) {
                let theta = start.max(0.0) / (start - end);
                if first.is_none_or(|(least, ..)| theta < least) {
                    first = Some((theta, guard, sign));
                }
            }
        }
        first.map(|(_, guard, sign)| (guard, sign))
    }

    /// The landing of an end between the start and the present state, at the time `t` after it.
    pub(super) fn landing_within(
        &self,
        sim: &Simulation,
        (guard, sign): (Guard, f64),
        t: f64,
        trials_left: usize,
    ) -> Landing {
        let mut a = Height::of(&self.sole_points, guard, sign, 0.0);
        // Rounding may leave it slightly below the ice.
        a.gap = a.gap.max(0.0);
        Landing {
            guard,
            sign,
            a,
            b: Height::of(&sim.sole_points, guard, sign, t),
            trials_left,
        }
    }

    /// Request a step to the estimated time of a landing.
    pub(super) fn locate_landing(
        &mut self,
        sim: &mut Simulation,
        mut landing: Landing,
    ) -> Result<Progress, Termination> {
        let Landing { a, b, .. } = landing;
        let t = a.cubic_zero(b);
        // An end that leaves the ice and returns within the step lands at the start.
        if t.min(a.linear_zero(b)) <= START_FRACTION * self.h {
            return self.land_at_start(sim, landing.guard);
        }
        sim.stats.root_iterations += 1;
        landing.trials_left -= 1;
        Ok(self.request_trial(t, Trial::Landing(landing)))
    }

    /// Continue after a step to the estimated time of a landing.
    pub(super) fn process_landing(
        &mut self,
        sim: &mut Simulation,
        mut landing: Landing,
    ) -> Result<Progress, Termination> {
        let Landing { guard, sign, .. } = landing;
        let (h, tolerance) = (self.request.h, LANDING_TOLERANCE * self.landing_depth());
        let height = Height::of(&sim.sole_points, guard, sign, h);
        let (exhausted, shortest) = (landing.trials_left == 0, self.h <= SHORTEST);
        let lands = height.gap.abs() < tolerance || shortest;
        if lands || exhausted {
            if !shortest {
                let other = self.first_landing(sim, Some(guard));
                if let Some(other) = other
                    && !exhausted
                {
                    // Another end lands before.
                    landing = self.landing_within(sim, other, h, landing.trials_left);
                    return self.locate_landing(sim, landing);
                }
                if other.is_some() || !lands && height.gap < 0.0 {
                    self.shorten(sim);
                    return Ok(Progress::Requested);
                }
            }
            self.h = h;
            if lands {
                // A release before the landing comes first.
                return self.release_or_finish(sim, Some(guard));
            }
            // The next step finds the landing from closer above the ice.
            self.share = 0.0;
            return self.finish(sim, None);
        }
        if height.gap > 0.0 {
            landing.a = height;
        } else {
            landing.b = height;
        }
        self.locate_landing(sim, landing)
    }

    /// Apply a landing at the start of the step. In push-only contact an end that this step has just opened does not land
    /// there: the step is made without the landing, and so short that the end stays close to the ice. In two-way contact an
    /// end that has landed stays on the ice for this step.
    fn land_at_start(
        &mut self,
        sim: &mut Simulation,
        guard: Guard,
    ) -> Result<Progress, Termination> {
        let just_opened = self.request.constraint.fixed && guard.landed(self.closed) == self.closed;
        let lands = self.attempts <= MAX_RESTARTS || !sim.model.contact.is_push_only;
        if !just_opened && lands {
            sim.state = self.request.start;
            sim.sole_points = self.sole_points;
            self.request.constraint.fixed = false;
            sim.land(guard)?;
            return Ok(self.restart(sim));
        }
        Ok(self.request_trial(self.h, Trial::FullWithoutLanding))
    }

    /// Complete a full step without the landing found in it, or shorten it.
    pub(super) fn process_without_landing(
        &mut self,
        sim: &mut Simulation,
    ) -> Result<Progress, Termination> {
        let gaps = sim.sole_points.gaps.as_flattened();
        let depth = -gaps.iter().fold(0.0_f64, |lowest, gap| lowest.min(*gap));
        if depth > DEEPEST && self.shorten(sim) {
            return Ok(Progress::Requested);
        }
        self.finish(sim, None)
    }
}
