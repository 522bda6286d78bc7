//! The stiff part of the equations of motion, for methods that are implicit in it: the friction of the
//! joints, D, and the controller's forces on the head, J_h^T (K_p, D_h) J_h, within one contact mode.
//!
//! With x = (r_q, r_v) and a = R tau for the accelerations a that torques tau cause in the mode,
//! (I - g A) k = r means k_q = r_q + g k_v and k_v = r_v - u, where within the mode's constraints
//!
//! ```text
//! (M + g D + J^T (g D_h + g^2 K) J) u = g D r_v + J^T ((g D_h + g^2 K) J r_v + g K J r_q).
//! ```

use crate::{
    contact::equations::Slip,
    control::lifting::{Feedback, feedback},
    dynamics::delassus::{FactoredDynamics, rows},
    error::Termination,
    model::{Model, contact_mode::ContactMode, layout::NV},
    rhs::{Evaluation, StepContext},
};

fn dot(a: &[f64], b: &[f64]) -> f64 {
    a.iter().zip(b).map(|(a, b)| a * b).sum()
}

/// See the module's documentation.
#[derive(Debug, Clone, Default)]
pub struct Implicit {
    factored: FactoredDynamics,
    g: f64,
    mode: Option<(ContactMode, Slip)>,
    /// Whether the controller exerts forces on the head, and their stiffness and damping.
    springs: bool,
    feedback: Feedback,
    /// Factorisations so far.
    pub count: u64,
}

impl Implicit {
    /// Factor the matrix of `solve` at the state of the last evaluation of `eval`.
    ///
    /// # Errors
    /// `Singular`, where the contact equations have no solution.
    pub fn factor(
        &mut self,
        model: &Model,
        eval: &Evaluation,
        context: &StepContext,
        g: f64,
    ) -> Result<(), Termination> {
        let free = context.mode.free.touch;
        self.count += 1;
        self.g = g;
        self.mode = Some((context.mode, context.slip));
        self.factored
            .factor(model, &eval.kin, (rows(free), eval.point), Some(g));
        let now = std::slice::from_ref(&context.now);
        self.springs = feedback(model, &eval.kin, now, &mut self.feedback);
        let Feedback { K, D, J } = &self.feedback;
        let regular = !self.springs || self.factored.add_stiffness(model, J, g * (D + g * K));
        regular.then_some(()).ok_or(Termination::Singular)
    }

    /// (q, v) := (I - g A)^-1 (q, v), `n` of each.
    ///
    /// # Errors
    /// As for `factor`.
    pub fn solve(
        &mut self,
        model: &Model,
        q: &mut [f64],
        v: &mut [f64],
    ) -> Result<(), Termination> {
        let g = self.g;
        let mode = self.mode.expect("factored");
        let mut u = [0.0; NV];
        for c in model.damped.clone() {
            u[c] = g * model.damping[c] * v[c];
        }
        if self.springs {
            let Feedback { K, D, J } = &self.feedback;
            for i in 0..3 {
                let (along_v, along_q) = (dot(&J[i], v), dot(&J[i], q));
                let force = g * (D[i] * along_v + K[i] * (g * along_v + along_q));
                for (u, J) in u.iter_mut().zip(&J[i]) {
                    *u += J * force;
                }
            }
        }
        self.factored.apply_inverse(model, mode, &mut u)?;
        for i in 0..v.len() {
            v[i] -= u[i];
            q[i] += g * v[i];
        }
        Ok(())
    }
}
