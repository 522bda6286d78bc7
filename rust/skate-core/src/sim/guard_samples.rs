//! Guard values at the integrator's stages inside a step. They need no extra evaluations and reveal events
//! that begin and end within one step.

use crate::events::{
    guard::Guard,
    guards::{Guards, MAX_GUARDS},
};

/// A cubic with a minimum below this fraction of the largest value is checked by evaluation.
const DIP_FRACTION: f64 = 0.05;

/// Value of a guard at a time, a fraction of the step.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Point {
    pub theta: f64,
    pub value: f64,
}

/// Guard samples of one attempted step.
#[derive(Debug, Clone, Copy)]
pub(crate) struct GuardSamples {
    guards: Guards,
    /// Start and length of the attempted step [s].
    t: f64,
    h: f64,
    /// Sample times as fractions of the step, and guard values there.
    theta: [f64; 2],
    values: [[f64; MAX_GUARDS]; 2],
    count: usize,
}

impl GuardSamples {
    /// No samples.
    pub fn none(guards: Guards) -> Self {
        Self {
            guards,
            t: 0.0,
            h: 0.0,
            theta: [0.0; 2],
            values: [[0.0; MAX_GUARDS]; 2],
            count: 0,
        }
    }

    /// Start a step at `t`; clears the samples. For `h` = 0 nothing is recorded.
    pub fn start_step(&mut self, guards: Guards, t: f64, h: f64) {
        (self.guards, self.t, self.h, self.count) = (guards, t, h, 0);
    }

    /// Is a sample due at the time `t`: well inside the step, and well after the last one?
    pub fn is_due(&self, t: f64) -> bool {
        let theta = (t - self.t) / self.h;
        let least = if self.count == 0 {
            0.25
        } else {
            self.theta[0] + 0.25
        };
        self.count < self.theta.len() && (least..0.85).contains(&theta)
    }

    /// Record the guards' values at a time for which a sample `is_due`.
    pub fn record(&mut self, t: f64, value: impl Fn(usize, Guard) -> f64) {
        self.theta[self.count] = (t - self.t) / self.h;
        let recorded = &mut self.values[self.count];
        for (i, guard) in self.guards.as_slice().iter().enumerate() {
            recorded[i] = value(i, *guard);
        }
        self.count += 1;
    }

    /// The samples of a guard.
    pub fn of(&self, guard: usize) -> impl Iterator<Item = Point> {
        (0..self.count).map(move |i| Point {
            theta: self.theta[i],
            value: self.values[i][guard],
        })
    }

    /// Time before `end`, as a fraction of the step, at which the polynomial through a guard's values at
    /// the start, the samples and `end` has a minimum near or below zero. All values are multiplied by `sign`, those
    /// given already.
    pub fn find_dip(&self, guard: usize, sign: f64, at_start: f64, end: Point) -> Option<f64> {
        let (end, at_end) = (end.theta, end.value);
        let inside = self.of(guard).filter(|sample| sample.theta < end);
        let mut size = at_start.max(at_end);
        // The chord through start and end; the remainder is x (1 - x) (a + b x).
        let mut rest = inside.map(|sample| {
            let (x, g) = (sample.theta / end, sign * sample.value);
            size = size.max(g.abs());
            (
                x,
                (g - at_start - x * (at_end - at_start)) / (x * (1.0 - x)),
            )
        });
        let (r, u) = rest.next()?;
        let b = rest.next().map_or(0.0, |(s, v)| (v - u) / (s - r));
        drop(rest);
        let a = u - b * r;
        // The derivative is slope + 2 half x - 3 b x^2; it increases at the minimum.
        let (slope, half) = (at_end - at_start + a, b - a);
        let x = -slope / (half + (half * half + 3.0 * b * slope).sqrt());
        let value = at_start + x * (at_end - at_start + (1.0 - x) * (a + b * x));
        ((0.001..0.999).contains(&x) && value < DIP_FRACTION * size).then_some(x * end)
    }
}
