//! Flow of a contact mode with its derivative.

use crate::{
    contact::equations::Slip,
    control::{ControllerInput, feedforward},
    derivatives::{
        dual::{
            Varied,
            evaluation::{factor, solve, update},
        },
        variation::{Variation, unpack},
    },
    dynamics::delassus::rows,
    error::Termination,
    events::guard::Guard,
    integrate::System,
    model::{
        contact_mode::{ContactMode, SoleContact},
        controller_terms::Term,
        lanes::ModelLanes,
        layout::NV,
    },
    numeric::{dual::Dual, scalar::Scalar, simd::with_avx2, trig::sin_cos_of, vec3},
    rhs::{Evaluation, StepContext, Torques},
    sim::NY,
};
use std::f64::consts::PI;

/// What the right-hand side depends on besides t, q and v.
#[derive(Debug, Clone)]
pub struct Context {
    pub mode: ContactMode,
    now: ControllerInput,
    times: [Dual<f64>; 3],
    tau7: Dual<f64>,
    residual: [Dual<f64>; NV],
}

impl Context {
    pub fn of(context: &StepContext, variation: &Variation<f64>) -> Self {
        Self {
            mode: context.mode,
            now: context.now,
            times: variation.times,
            tau7: variation.tau7,
            residual: variation.residual,
        }
    }

    /// The same without derivatives.
    pub fn constant(&self) -> Self {
        Self {
            times: self.times.map(Dual::detached),
            tau7: self.tau7.detached(),
            residual: self.residual.map(Dual::detached),
            ..self.clone()
        }
    }

    /// Open-loop torques, Eqs. 16 to 22, at the time `t`.
    #[inline(always)]
    fn open_loop(&self, models: Varied<'_>, t: Dual<f64>) -> [Dual<f64>; NV] {
        let mut tau = [Dual::default(); NV];
        let phase = self.now.controller.phase;
        for (i, term) in models.model.controller_terms.iter().enumerate() {
            match term {
                Term::Feedforward(_) => {
                    let start = self.times[feedforward::start_of(phase)];
                    let (_, cos) = sin_cos_of(Dual::of(PI) * (t - start));
                    let scales = [0, 1].map(|k| {
                        models.number(|m| match &m.controller_terms[i] {
                            Term::Feedforward(law) => feedforward::scales(law)[k],
                            _ => 0.0,
                        })
                    });
                    feedforward::add(scales, phase, (cos, self.tau7), &mut tau);
                }
                Term::ArmSwing { yaw, .. } => {
                    let amplitude: Dual<f64> = models.number(|m| match &m.controller_terms[i] {
                        Term::ArmSwing { amplitude, .. } => *amplitude,
                        _ => 0.0,
                    });
                    let sign = Dual::of(self.now.controller.leg.sign());
                    let sin = (Dual::of(PI) * (t - self.times[0])).sin();
                    tau[*yaw] += sign * amplitude * sin;
                }
                _ => {}
            }
        }
        tau
    }
}

/// Accelerations and contact forces at (t, q, v) in the mode of `context`; false where the constraints depend on
/// each other.
#[inline(never)]
pub fn accelerations(
    eval: &mut Evaluation<Dual<f64>>,
    models: Varied<'_>,
    context: &Context,
    t: Dual<f64>,
    (q, v): (&[Dual<f64>; NV], &[Dual<f64>; NV]),
) -> bool {
    with_avx2(
        #[inline(always)]
        || {
            let mode = context.mode;
            update(eval, models, mode, (q, v));
            factor(eval, models, rows(mode.free.touch));
            let now = std::slice::from_ref(&context.now);
            let torques = Torques {
                feedforward: &context.open_loop(models, t),
                residual: &context.residual,
            };
            eval.load(models, (q, v), now, torques);
            let slip = Slip::of(models, mode);
            let regular;
            (eval.solution, regular) = solve(eval, mode, slip);
            if mode.free.touch == SoleContact::Air {
                eval.solution.a_free = vec3::zero();
            }
            eval.back_substitute(models);
            regular
        },
    )
}

/// One mode, on dual numbers.
pub struct Flow<'a> {
    pub eval: &'a mut Evaluation<Dual<f64>>,
    pub models: Varied<'a>,
    pub context: Context,
    /// Whether the constraints have been independent at every evaluation.
    pub regular: bool,
}

impl Flow<'_> {
    /// A guard at an integrated vector.
    pub fn guard(&mut self, guard: Guard, t: Dual<f64>, y: &[Dual<f64>; NY]) -> Dual<f64> {
        let n = self.models.model.n.min(NV);
        accelerations(self.eval, self.models, &self.context, t, unpack(y, n));
        guard.value(self.models, self.eval, self.context.mode, (y[1], y[n]))
    }
}

impl System<NY, Dual<f64>> for Flow<'_> {
    fn rhs(
        &mut self,
        t: Dual<f64>,
        y: &[Dual<f64>; NY],
        dy: &mut [Dual<f64>; NY],
    ) -> Result<(), Termination> {
        let n = self.models.model.n.min(NV);
        let (q, v) = unpack(y, n);
        self.regular &= accelerations(self.eval, self.models, &self.context, t, (q, v));
        dy[..n].copy_from_slice(&v[..n]);
        dy[n..2 * n].copy_from_slice(&self.eval.qdd[..n]);
        Ok(())
    }

    fn factor(&mut self, _: &[Dual<f64>; NY], _: Dual<f64>) -> Result<(), Termination> {
        Err(Termination::Singular)
    }

    fn solve(&mut self, _: &mut [Dual<f64>; NY]) -> Result<(), Termination> {
        Err(Termination::Singular)
    }
}
