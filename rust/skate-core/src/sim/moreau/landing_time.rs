//! When an end of a sole comes down to the ice, from where it was and how it moved before and after.

use crate::{
    events::guard::{GAP_TOLERANCE, Guard},
    rhs::sole_points::SolePoints,
};

/// Iterations for the zero of a cubic: more than enough.
const NEWTON: usize = 6;

/// Where an end of a sole is some time after the start of a step, and how fast it rises.
#[derive(Debug, Clone, Copy)]
pub struct Height {
    at: f64,
    pub gap: f64,
    rate: f64,
}

impl Height {
    /// Of the end that a guard watches; `sign` is -1 where it comes from below.
    pub fn of(sole_points: &SolePoints, guard: Guard, sign: f64, at: f64) -> Self {
        let (gap, rate) = match guard {
            Guard::Gap(which, end) => (
                sole_points.gap(which, end) + GAP_TOLERANCE,
                sole_points.speeds[which][end as usize][1],
            ),
            _ => (f64::INFINITY, 0.0),
        };
        Self {
            at,
            gap: sign * gap,
            rate: sign * rate,
        }
    }

    /// When, from above until `below`, the straight line through both heights falls to zero,
    pub fn line(self, below: Self) -> f64 {
        self.at + (below.at - self.at) * self.gap / (self.gap - below.gap)
    }

    /// and the cubic that has both rates, too.
    pub fn zero(self, below: Self) -> f64 {
        let length = below.at - self.at;
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
        self.at + x * length
    }
}
