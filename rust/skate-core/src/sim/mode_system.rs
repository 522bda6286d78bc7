//! The dynamics in one contact mode, as a system for the integration methods.

use crate::{
    contact::equations::Y,
    error::Termination,
    events::guard::Guard,
    integrate::{Size, System, TimeStep},
    model::{Model, contact_mode::ContactMode, lanes::ModelLanes, layout::NV},
    numeric::{scalar::Scalar, simd::with_avx2},
    rhs::{Evaluation, StepContext, jacobian::Implicit},
    sim::{NY, Simulation, guard_samples::GuardSamples},
};

/// Sizes of the error control: 1 rad (m), which keeps translations and whole revolutions symmetries, and
/// 10 rad/s (m/s) plus the velocity. The powers of the energy balance are integrated without error control.
pub(super) fn sizes(model: &Model) -> Vec<Size> {
    let powers = if model.scene.energy_balance { 3 } else { 0 };
    let n = model.n;
    let size = |absolute, relative| Size { absolute, relative };
    let powers = vec![size(f64::INFINITY, 0.0); powers];
    [vec![size(1.0, 0.0); n], vec![size(10.0, 1.0); n], powers].concat()
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
#[inline(always)]
pub(crate) fn unpack<T>(y: &[T; NY], n: usize) -> (&[T; NV], &[T; NV]) {
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

impl Simulation {
    /// The attempted step, and the dynamics in the present mode.
    #[inline(always)]
    pub(super) fn mode_system(&mut self) -> (&mut TimeStep<NY>, ModeSystem<'_>) {
        let system = ModeSystem {
            model: &self.model,
            eval: &mut self.eval,
            implicit: &mut self.implicit,
            guard_samples: &mut self.guard_samples,
            context: StepContext::of(&self.model, &self.state, &self.residual),
        };
        (&mut self.step, system)
    }
}

impl System<NY> for ModeSystem<'_> {
    fn rhs(&mut self, t: f64, y: &[f64; NY], dy: &mut [f64; NY]) -> Result<(), Termination> {
        let n = self.model.n.min(NV);
        let (q, v) = unpack(y, n);
        self.context.now.t = t;
        self.eval.accelerations(self.model, q, v, &self.context)?;
        with_avx2(
            #[inline(always)]
            || slope(self.model, self.eval, self.context.mode, v, dy),
        );
        let (model, eval, mode) = (self.model, &*self.eval, self.context.mode);
        if self.guard_samples.is_due(t) {
            let value = |_, guard: Guard| guard.value(model, eval, mode, (q[1], v[0]));
            self.guard_samples.record(t, value);
        }
        Ok(())
    }

    fn factor(&mut self, y: &[f64; NY], g: f64) -> Result<(), Termination> {
        let state = unpack(y, self.model.n.min(NV));
        self.implicit
            .factor(self.model, (self.eval, state), &self.context, g)
    }

    fn solve(&mut self, x: &mut [f64; NY]) -> Result<(), Termination> {
        let n = self.model.n.min(NV);
        let (q, rest) = x.split_at_mut(n);
        self.implicit.solve(self.model, q, &mut rest[..n])
    }
}

/// Derivative of the integrated vector from an evaluation at the velocities `v`.
#[inline(always)]
pub(crate) fn slope<T: Scalar>(
    models: impl ModelLanes<T>,
    eval: &Evaluation<T>,
    mode: ContactMode,
    v: &[T; NV],
    dy: &mut [T; NY],
) {
    let n = models.shape().n.min(NV);
    // A copy of a fixed length needs no call. Entries beyond the first n are zero, and the next copy overwrites them.
    dy[..NV].copy_from_slice(v);
    dy[n..n + NV].copy_from_slice(&eval.qdd);
    if models.shape().scene.energy_balance {
        dy[2 * n..2 * n + 3].copy_from_slice(&powers(models, eval, mode, v));
    }
}

/// Power of the torques, and power dissipated by damping and by friction [W].
#[inline(always)]
fn powers<T: Scalar>(
    models: impl ModelLanes<T>,
    eval: &Evaluation<T>,
    mode: ContactMode,
    v: &[T; NV],
) -> [T; 3] {
    let (mut actuators, mut damping) = (T::zero(), T::zero());
    let of = |c: usize| models.number(|m| m.damping[c]) * v[c] * v[c];
    for c in 0..models.shape().n.min(NV) {
        actuators += eval.tau[c] * v[c];
        damping += of(c);
    }
    // D includes the viscous friction of the ice.
    let mut friction = of(0);
    damping -= friction;
    if mode.support.slides() {
        friction -= eval.solution.f_root[Y] * v[0];
    }
    if mode.free.slides() {
        friction -= eval.solution.lam[Y] * eval.point_velocity[Y];
    }
    [actuators, damping, friction]
}
