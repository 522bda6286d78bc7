//! The stiff part of the equations of motion, for methods that are implicit in it: the friction of the
//! joints, D, and visual lifting, J_h^T K_p J_h, within one contact mode.
//!
//! With x = (r_q, r_v) and a = R tau for the accelerations a that torques tau cause in the mode,
//! (I - g A) k = r means k_q = r_q + g k_v and k_v = r_v - u, where
//!
//! ```text
//! (M + g D + g^2 J^T K J) u = g D r_v + J^T K J (g^2 r_v + g r_q)   within the mode's constraints.
//! ```
//!
//! D adds to the joints' own inertias in the factor; lifting, of rank 3, follows by Woodbury's identity.

use crate::{
    contact::{Mode, Slip},
    control::{Term, lifting::head_jacobian},
    error::EndCause,
    evaluate::{Evaluation, Frozen},
    factored::{Factored, dot},
    model::{Model, NV},
};
use nalgebra::{Matrix3, Vector3};

/// See the module's documentation.
#[derive(Debug, Clone, Default)]
pub struct Implicit {
    factored: Factored,
    g: f64,
    mode: Option<(Mode, Slip)>,
    lifting: Option<Lifting>,
    /// Factorisations so far.
    pub count: u64,
}

#[derive(Debug, Clone)]
struct Lifting {
    K: Vector3<f64>,
    /// Rows of J, and what each causes as a force: columns of (M + g D)^-1 J^T.
    J: [[f64; NV]; 3],
    U: [[f64; NV]; 3],
    /// (I + g^2 K J U)^-1 g^2 K
    small: Matrix3<f64>,
}

impl Implicit {
    /// Prepare `solve` at the state that `eval` was last evaluated for.
    ///
    /// # Errors
    /// `Singular`, where the contact equations have no solution.
    pub fn factor(
        &mut self,
        model: &Model,
        eval: &Evaluation,
        frozen: &Frozen,
        g: f64,
    ) -> Result<(), EndCause> {
        let mode = (frozen.mode, frozen.slip);
        self.count += 1;
        self.g = g;
        self.mode = Some(mode);
        self.factored
            .factor(model, &eval.kin, (frozen.mode.free.touch, eval.point), g);
        self.lifting = None;
        // A controller that has not yet noticed a swap counts the joints from the other foot; it will
        // within a millisecond.
        if !frozen.now.clock.supported || frozen.now.mirrored {
            return Ok(());
        }
        let law = model.controller.iter().find_map(|term| match term {
            Term::Lifting(law) => Some(law),
            _ => None,
        });
        if let Some(law) = law {
            let K = Vector3::from(law.K_p);
            let J = head_jacobian(model, &eval.kin, &frozen.now);
            let mut U = J;
            for column in &mut U {
                self.factored.respond(model, mode, column)?;
            }
            let KC = Matrix3::from_fn(|i, j| g * g * K[i] * dot(&J[i], &U[j]));
            let inverse = (Matrix3::identity() + KC).try_inverse();
            let small = inverse.ok_or(EndCause::Singular)? * Matrix3::from_diagonal(&(g * g * K));
            self.lifting = Some(Lifting { K, J, U, small });
        }
        Ok(())
    }

    /// (q, v) := (I - g A)^-1 (q, v), `n` of each.
    ///
    /// # Errors
    /// As for `factor`.
    pub fn solve(&mut self, model: &Model, q: &mut [f64], v: &mut [f64]) -> Result<(), EndCause> {
        let g = self.g;
        let mode = self.mode.expect("factored");
        let mut u = [0.0; NV];
        for c in model.damped.clone() {
            u[c] = g * model.damping[c] * v[c];
        }
        if let Some(law) = &self.lifting {
            for (J, K) in law.J.iter().zip(&law.K) {
                let force = K * (g * g * dot(J, v) + g * dot(J, q));
                for (u, J) in u.iter_mut().zip(J) {
                    *u += J * force;
                }
            }
        }
        self.factored.respond(model, mode, &mut u)?;
        if let Some(law) = &self.lifting {
            let force = law.small * Vector3::from_fn(|i, _| dot(&law.J[i], &u));
            for (U, force) in law.U.iter().zip(&force) {
                for (u, U) in u.iter_mut().zip(U) {
                    *u -= U * force;
                }
            }
        }
        for i in 0..v.len() {
            v[i] -= u[i];
            q[i] += g * v[i];
        }
        Ok(())
    }
}
