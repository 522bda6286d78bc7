//! The robot in one contact mode, as integration methods see it.

use super::NY;
use crate::{
    contact::Y,
    error::EndCause,
    evaluate::{Evaluation, Frozen},
    guards::{Guards, MOST},
    implicit::Implicit,
    integrate::System,
    model::{Model, NV},
};

/// Scales of the error control: 1 rad (m) and 10 rad/s (m/s). The ledger's powers, if there is one, are
/// integrated along.
pub(super) fn scales(model: &Model) -> Vec<f64> {
    let powers = if model.scene.ledger { 3 } else { 0 };
    let n = model.n;
    [vec![1.0; n], vec![10.0; n], vec![f64::INFINITY; powers]].concat()
}

/// Positions and velocities in the integrated vector; what follows the first `n` of each means nothing.
pub(super) fn unpack(y: &[f64; NY], n: usize) -> (&[f64; NV], &[f64; NV]) {
    let window = |from: usize| y[from..].first_chunk().expect("NY > 2 NV");
    (window(0), window(n))
}

/// Guards at stages well inside a step, as the method came by them: rough, but for nothing.
#[derive(Debug, Clone)]
pub(super) struct Glimpses {
    guards: Guards,
    /// The step attempted.
    t: f64,
    h: f64,
    /// Where, as fractions of it, and the values there.
    theta: [f64; 2],
    values: [[f64; MOST]; 2],
    count: usize,
}

impl Glimpses {
    /// Of no step yet.
    pub fn none(guards: Guards) -> Self {
        Self {
            guards,
            t: 0.0,
            h: 0.0,
            theta: [0.0; 2],
            values: [[0.0; MOST]; 2],
            count: 0,
        }
    }

    /// Forget; the next step begins at `t`. One of no length is not watched.
    pub fn begin(&mut self, guards: Guards, t: f64, h: f64) {
        (self.guards, self.t, self.h, self.count) = (guards, t, h, 0);
    }

    /// Where, before `end`, a polynomial through a guard's values there, at the start and at the stages
    /// comes near zero or below, as a fraction of the step.
    pub fn dip(&self, guard: usize, at_start: f64, (end, at_end): (f64, f64)) -> Option<f64> {
        let inside = (0..self.count).filter(|&i| self.theta[i] < end);
        let mut size = at_start.max(at_end);
        // Through start and end goes a straight line; the rest is x (1 - x) (a + b x).
        let mut rest = inside.map(|i| {
            let (x, g) = (self.theta[i] / end, self.values[i][guard]);
            size = size.max(g.abs());
            (
                x,
                (g - at_start - x * (at_end - at_start)) / (x * (1.0 - x)),
            )
        });
        let (r, u) = rest.next()?;
        let b = match rest.next() {
            Some((s, v)) if s > r => (v - u) / (s - r),
            _ => 0.0,
        };
        drop(rest);
        let a = u - b * r;
        // The derivative is slope + 2 half x - 3 b x^2; at the minimum it rises.
        let (slope, half) = (at_end - at_start + a, b - a);
        let x = -slope / (half + (half * half + 3.0 * b * slope).sqrt());
        let value = at_start + x * (at_end - at_start + (1.0 - x) * (a + b * x));
        ((0.001..0.999).contains(&x) && value < NEAR * size).then_some(x * end)
    }
}

/// A cubic that comes so near to zero, in shares of the largest value, is looked at.
const NEAR: f64 = 0.05;

/// See the module's documentation.
pub(super) struct Robot<'a> {
    pub model: &'a Model,
    pub eval: &'a mut Evaluation,
    pub implicit: &'a mut Implicit,
    pub glimpses: &'a mut Glimpses,
    pub frozen: Frozen,
}

impl System<NY> for Robot<'_> {
    fn rhs(&mut self, t: f64, y: &[f64; NY], dy: &mut [f64; NY]) -> Result<(), EndCause> {
        let n = self.model.n.min(NV);
        let (q, v) = unpack(y, n);
        self.frozen.now.t = t;
        self.eval.accelerations(self.model, q, v, &self.frozen)?;
        dy[..n].copy_from_slice(&v[..n]);
        dy[n..2 * n].copy_from_slice(&self.eval.qdd[..n]);
        if self.model.scene.ledger {
            dy[2 * n..2 * n + 3].copy_from_slice(&self.powers(v));
        }
        let glimpses = &mut *self.glimpses;
        let theta = (t - glimpses.t) / glimpses.h;
        if glimpses.count < 2 && (0.25..0.85).contains(&theta) {
            glimpses.theta[glimpses.count] = theta;
            let values = &mut glimpses.values[glimpses.count];
            for (value, guard) in values.iter_mut().zip(glimpses.guards.as_slice()) {
                *value = guard.value(self.model, self.eval, self.frozen.mode, (q[1], v[0]));
            }
            glimpses.count += 1;
        }
        Ok(())
    }

    fn factor(&mut self, g: f64) -> Result<(), EndCause> {
        self.implicit.factor(self.model, self.eval, &self.frozen, g)
    }

    fn solve(&mut self, x: &mut [f64; NY]) -> Result<(), EndCause> {
        let n = self.model.n.min(NV);
        let (q, rest) = x.split_at_mut(n);
        self.implicit.solve(self.model, q, &mut rest[..n])
    }
}

impl Robot<'_> {
    /// Of the torques, and what damping and friction take [W].
    fn powers(&self, v: &[f64; NV]) -> [f64; 3] {
        let (mut actuators, mut damping) = (0.0, 0.0);
        let of = |c: usize| self.model.damping[c] * v[c] * v[c];
        for c in 0..self.model.n.min(NV) {
            actuators += self.eval.tau[c] * v[c];
            damping += of(c);
        }
        // D holds the ice's viscous friction, too.
        let mut friction = of(0);
        damping -= friction;
        if self.frozen.mode.support.slides() {
            friction -= self.eval.solution.f_root[Y] * v[0];
        }
        if self.frozen.mode.free.slides() {
            friction -= self.eval.solution.lam[Y] * self.eval.point_velocity[Y];
        }
        [actuators, damping, friction]
    }
}
