//! Derivatives of guards by positions, velocities and contact forces.

use crate::{
    contact::equations::Solution,
    derivatives::{
        dual::{Varied, evaluation::update},
        linear::{
            flow::{Inputs, apply},
            jacobian::{Jacobian, ROWS},
        },
    },
    events::guard::Guard,
    model::{
        Model,
        contact_mode::ContactMode,
        layout::{LEG, NV},
    },
    numeric::{dual::Dual, scalar::Scalar, simd::Register},
    rhs::Evaluation,
};

/// Derivatives of a guard: by q and v for one of positions and velocities of the feet, else by the contact forces, in
/// the order of a Jacobian's rows.
#[derive(Debug, Clone, Copy, Default)]
pub struct Gradient {
    q: [f64; LEG],
    v: [f64; LEG],
    forces: [f64; ROWS - NV],
}

impl Gradient {
    /// At a state with the Jacobian there.
    pub fn of(
        model: &Model,
        (guard, mode): (Guard, ContactMode),
        (jacobian, q): (&Jacobian, &[f64; NV]),
        eval: &mut Evaluation<Dual<f64>>,
    ) -> Self {
        let models = Varied::constant(model);
        let mut gradient = Self::default();
        if !guard.is_kinematic() {
            for i in 0..ROWS - NV {
                let mut forces = [0, 1, 2, 3, 4, 5].map(|i| Dual::of(jacobian.value[NV + i]));
                forces[i].d = 1.0;
                let [a, b, c, d, e, f] = forces;
                eval.solution = Solution {
                    f_root: [a, b, c].into(),
                    lam: [d, e, f].into(),
                    ..Solution::default()
                };
                let zero = Dual::default();
                gradient.forces[i] = guard.value(models, eval, mode, (zero, zero)).d;
            }
            return gradient;
        }
        let (q, v) = (q.map(Dual::of), jacobian.v.map(Dual::of));
        for c in 0..LEG {
            let (mut moved, mut faster) = (q, v);
            (moved[c].d, faster[c].d) = (1.0, 1.0);
            update(eval, models, mode, (&moved, &v));
            gradient.q[c] = guard.value(models, eval, mode, (moved[1], v[0])).d;
            update(eval, models, mode, (&q, &faster));
            gradient.v[c] = guard.value(models, eval, mode, (q[1], faster[0])).d;
        }
        gradient
    }

    /// Derivative by those of the time, of q and of v.
    #[inline(always)]
    pub fn along<R: Register>(
        &self,
        (n, jacobian): (usize, &Jacobian),
        inputs: &Inputs<R>,
        (t, q, v): (R, &[R; NV], &[R; NV]),
    ) -> R {
        let mut sum = R::zero();
        for c in 0..LEG {
            sum += R::of(self.q[c]) * q[c] + R::of(self.v[c]) * v[c];
        }
        if self.forces.iter().any(|x| *x != 0.0) {
            let mut rows = [R::zero(); ROWS];
            apply(n, jacobian, inputs, (t, q, v), &mut rows);
            for (row, by) in rows[NV..].iter().zip(self.forces) {
                sum += R::of(by) * *row;
            }
        }
        sum
    }
}
