//! Flow of a contact mode from Jacobians.

use crate::{
    control::feedforward::start_of,
    derivatives::{
        linear::{
            inputs::{COLUMNS, columns, position, times, torque, velocity},
            jacobian::{Differentiator, Jacobian},
        },
        parameters::Varied,
        variation::Variation,
    },
    error::Termination,
    integrate::System,
    model::layout::{NV, ROOT},
    numeric::{
        dual::Dual,
        scalar::{Mask, Scalar},
        simd::Register,
    },
    rhs::StepContext,
    sim::{NY, mode_system::unpack},
};

/// One mode as a system that keeps the Jacobian of every evaluation.
pub struct MotionFlow<'a, R: Register> {
    pub differentiator: &'a mut Differentiator<R>,
    pub varied: Varied<'a>,
    pub context: &'a StepContext,
    pub jacobians: &'a mut Jacobians,
}

/// The Jacobians of a step, in order; the memory stays.
#[derive(Debug, Clone, Default)]
pub struct Jacobians {
    all: Vec<Jacobian>,
    len: usize,
}

impl Jacobians {
    pub fn clear(&mut self) {
        self.len = 0;
    }

    pub fn as_slice(&self) -> &[Jacobian] {
        &self.all[..self.len]
    }

    fn next(&mut self) -> &mut Jacobian {
        if self.len == self.all.len() {
            self.all.push(Jacobian::default());
        }
        self.len += 1;
        &mut self.all[self.len - 1]
    }
}

impl<R: Register> System<NY> for MotionFlow<'_, R> {
    fn rhs(&mut self, t: f64, y: &[f64; NY], dy: &mut [f64; NY]) -> Result<(), Termination> {
        let n = self.varied.model.n.min(NV);
        let jacobian = self.jacobians.next();
        let (q, v) = unpack(y, n);
        self.differentiator
            .update(self.varied, self.context, (t, q, v), jacobian);
        dy[..n].copy_from_slice(&v[..n]);
        dy[n..2 * n].copy_from_slice(&jacobian.value[..n]);
        Ok(())
    }
}

/// Derivatives of the torques, and of the times since the feedforward's phase and since the leg swap began; the
/// directions' parameters.
#[derive(Debug, Clone, Default)]
pub struct Inputs<R> {
    residual: [R; NV],
    times: [R; 2],
    pub parameter: Option<usize>,
}

impl<R: Scalar> Inputs<R> {
    #[inline(always)]
    pub fn of(context: &StepContext, state: &Variation<R>) -> Self {
        let phase = start_of(context.now.controller.phase);
        Self {
            residual: state.residual.map(|tau| tau.d),
            times: [phase, 0].map(|i| -state.times[i].d),
            parameter: state.parameter,
        }
    }
}

/// Derivatives of the first `N` rows of a `Jacobian` by those of the time, of q and of v.
#[inline(never)]
pub fn apply<const N: usize, R: Register>(
    n: usize,
    jacobian: &Jacobian,
    inputs: &Inputs<R>,
    (t, q, v): (R, &[R; NV], &[R; NV]),
    out: &mut [R; N],
) {
    R::with_target_features(
        #[inline(always)]
        || {
            let n = n.min(NV);
            let mut x = [R::zero(); COLUMNS];
            for c in 0..n {
                if c > 0 {
                    x[position(c)] = q[c];
                }
                x[velocity(n, c)] = v[c];
                if c >= ROOT {
                    x[torque(n, c)] = inputs.residual[c];
                }
            }
            for (i, at) in times(n).into_iter().enumerate() {
                x[at] = t + inputs.times[i];
            }
            let mut sum = [R::zero(); N];
            for (x, column) in x[..columns(n)].iter().zip(&jacobian.columns) {
                // Many directions leave most of the inputs unchanged.
                if !x.abs().le(R::zero()).all() {
                    for (sum, entry) in sum.iter_mut().zip(column) {
                        *sum += R::of(*entry) * *x;
                    }
                }
            }
            if let Some(explicit) = jacobian.by_parameter.along::<R>(inputs.parameter) {
                for (sum, explicit) in sum.iter_mut().zip(explicit) {
                    *sum += explicit;
                }
            }
            *out = sum;
        },
    );
}

/// One mode in the fraction of a step, which has the length `h`: y' = h f(t + theta h, y), differentiated.
pub struct LinearFlow<'a, R> {
    pub n: usize,
    pub h: Dual<R>,
    /// Derivative of the time at the start.
    pub t: R,
    pub jacobians: std::slice::Iter<'a, Jacobian>,
    pub inputs: Inputs<R>,
    /// Derivative of f at the last evaluation.
    pub slope: Box<[R; NY]>,
}

impl<R: Register> LinearFlow<'_, R> {
    /// Derivative of h f where that of f is `slope`, at the values of a Jacobian.
    #[inline(always)]
    fn scaled(&self, jacobian: &Jacobian, slope: &[R; NY], dy: &mut [R; NY]) {
        let n = self.n.min(NV);
        let h = R::of(self.h.x);
        for c in 0..n {
            dy[c] = h * slope[c] + R::of(jacobian.v[c]) * self.h.d;
            dy[n + c] = h * slope[n + c] + R::of(jacobian.value[c]) * self.h.d;
        }
    }

    /// `scaled` for the slope that is known at the start, with the values there.
    #[inline(always)]
    pub fn start(&self, values: &[f64; NY], dy: &mut [R; NY]) {
        let h = R::of(self.h.x);
        for (dy, (slope, value)) in dy.iter_mut().zip(self.slope.iter().zip(values)) {
            *dy = h * *slope + R::of(*value) * self.h.d;
        }
    }
}

impl<R: Register> System<NY, R> for LinearFlow<'_, R> {
    #[inline(always)]
    fn rhs(&mut self, theta: R, y: &[R; NY], dy: &mut [R; NY]) -> Result<(), Termination> {
        let n = self.n.min(NV);
        let (q, v) = unpack(y, n);
        let jacobian = self.jacobians.next().ok_or(Termination::NotFinite)?;
        let mut rows = [R::zero(); NV];
        let t = self.t + theta * self.h.d;
        apply(n, jacobian, &self.inputs, (t, q, v), &mut rows);
        self.slope[..n].copy_from_slice(&v[..n]);
        self.slope[n..2 * n].copy_from_slice(&rows[..n]);
        self.scaled(jacobian, &self.slope, dy);
        Ok(())
    }
}
