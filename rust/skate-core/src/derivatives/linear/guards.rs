//! Derivatives of guards by positions, velocities, contact forces and parameters.

use crate::{
    contact::equations::Solution,
    derivatives::{
        linear::{
            flow::{Inputs, apply},
            jacobian::{Jacobian, ROWS},
        },
        parameters::{Slopes, Varied},
    },
    events::guard::Guard,
    model::{
        contact_mode::ContactMode,
        lanes::Broadcast,
        layout::{LEG, NV},
    },
    numeric::{dual::Dual, scalar::Scalar, simd::Register},
    rhs::{Evaluation, Stance},
};

/// Derivatives of a guard: by q and v for one of positions and velocities of the feet, else by the contact forces, in
/// the order of a Jacobian's rows. The explicit derivative by every parameter is added.
#[derive(Debug, Clone, Default)]
pub struct Gradient {
    q: [f64; LEG],
    v: [f64; LEG],
    forces: [f64; ROWS - NV],
    by_parameter: Slopes<1>,
}

impl Gradient {
    /// At a state with the Jacobian there.
    pub fn of(
        Varied { model, parameters }: Varied<'_>,
        (guard, mode): (Guard, ContactMode),
        (jacobian, q): (&Jacobian, &[f64; NV]),
        (eval, other_eval): (&mut Evaluation<Dual<f64>>, &mut Evaluation),
    ) -> Self {
        let models = Broadcast(model);
        let balance = jacobian.balance(mode, q);
        let mut gradient = Self {
            by_parameter: parameters.slopes(|other| [balance.guard(guard, other, other_eval)]),
            ..Self::default()
        };
        let stance = Stance::of(models, mode);
        let (q, v) = (q.map(Dual::of), jacobian.v.map(Dual::of));
        if !guard.is_kinematic() {
            eval.update_kinematics(models, &stance, &q, &v);
            for i in 0..ROWS - NV {
                let (f_root, lam) = (balance.f_root.map(Dual::of), balance.lam.map(Dual::of));
                eval.solution = Solution {
                    f_root,
                    lam,
                    ..Solution::default()
                };
                let solution = &mut eval.solution;
                match i.checked_sub(3) {
                    None => solution.f_root[i].d = 1.0,
                    Some(i) => solution.lam[i].d = 1.0,
                }
                let zero = Dual::default();
                gradient.forces[i] = guard.value(models, eval, mode, (zero, zero)).d;
            }
            return gradient;
        }
        for c in 0..LEG {
            let (mut moved, mut faster) = (q, v);
            (moved[c].d, faster[c].d) = (1.0, 1.0);
            eval.update_kinematics(models, &stance, &moved, &v);
            gradient.q[c] = guard.value(models, eval, mode, (moved[1], v[0])).d;
            eval.update_kinematics(models, &stance, &q, &faster);
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
        if let Some([explicit]) = self.by_parameter.along::<R>(inputs.parameter) {
            sum += explicit;
        }
        sum
    }
}
