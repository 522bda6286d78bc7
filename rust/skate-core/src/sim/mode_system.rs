//! The dynamics in one contact mode, as a system for the integration methods.

use crate::{
    contact::equations::Y,
    error::Termination,
    integrate::System,
    model::{Model, layout::NV},
    rhs::{Evaluation, StepContext, jacobian::Implicit},
    sim::{NY, guard_samples::GuardSamples},
};

/// Scales of the error control: 1 rad (m) and 10 rad/s (m/s). The powers of the energy balance are
/// integrated without error control.
pub(super) fn scales(model: &Model) -> Vec<f64> {
    let powers = if model.scene.energy_balance { 3 } else { 0 };
    let n = model.n;
    [vec![1.0; n], vec![10.0; n], vec![f64::INFINITY; powers]].concat()
}

/// Groups of coordinates whose errors are summed separately: right arm, left arm, all others.
pub(super) fn error_groups(model: &Model) -> Vec<u8> {
    let arm = |name: &&str| match *name {
        "q11" | "q12" | "q13" => 1,
        "q14" | "q15" | "q16" => 2,
        _ => 0,
    };
    let arms: Vec<u8> = model.names.iter().map(arm).collect();
    arms.repeat(2)
}

/// Positions and velocities in the integrated vector; entries beyond the first `n` are unused.
pub(super) fn unpack(y: &[f64; NY], n: usize) -> (&[f64; NV], &[f64; NV]) {
    let window = |from: usize| y[from..].first_chunk().expect("NY > 2 NV");
    (window(0), window(n))
}

/// Dynamics in one contact mode; implements `System`.
pub(super) struct ModeSystem<'a> {
    pub model: &'a Model,
    pub eval: &'a mut Evaluation,
    pub implicit: &'a mut Implicit,
    pub guard_samples: &'a mut GuardSamples,
    pub context: StepContext,
}

impl System<NY> for ModeSystem<'_> {
    fn rhs(&mut self, t: f64, y: &[f64; NY], dy: &mut [f64; NY]) -> Result<(), Termination> {
        let n = self.model.n.min(NV);
        let (q, v) = unpack(y, n);
        self.context.now.t = t;
        self.eval.accelerations(self.model, q, v, &self.context)?;
        dy[..n].copy_from_slice(&v[..n]);
        dy[n..2 * n].copy_from_slice(&self.eval.qdd[..n]);
        if self.model.scene.energy_balance {
            dy[2 * n..2 * n + 3].copy_from_slice(&self.powers(v));
        }
        let (model, eval, mode) = (self.model, &*self.eval, self.context.mode);
        self.guard_samples
            .record(t, |guard| guard.value(model, eval, mode, (q[1], v[0])));
        Ok(())
    }

    fn factor(&mut self, g: f64) -> Result<(), Termination> {
        self.implicit
            .factor(self.model, self.eval, &self.context, g)
    }

    fn solve(&mut self, x: &mut [f64; NY]) -> Result<(), Termination> {
        let n = self.model.n.min(NV);
        let (q, rest) = x.split_at_mut(n);
        self.implicit.solve(self.model, q, &mut rest[..n])
    }
}

impl ModeSystem<'_> {
    /// Power of the torques, and power dissipated by damping and by friction [W].
    fn powers(&self, v: &[f64; NV]) -> [f64; 3] {
        let (mut actuators, mut damping) = (0.0, 0.0);
        let of = |c: usize| self.model.damping[c] * v[c] * v[c];
        for c in 0..self.model.n.min(NV) {
            actuators += self.eval.tau[c] * v[c];
            damping += of(c);
        }
        // D includes the viscous friction of the ice.
        let mut friction = of(0);
        damping -= friction;
        if self.context.mode.support.slides() {
            friction -= self.eval.solution.f_root[Y] * v[0];
        }
        if self.context.mode.free.slides() {
            friction -= self.eval.solution.lam[Y] * self.eval.point_velocity[Y];
        }
        [actuators, damping, friction]
    }
}
