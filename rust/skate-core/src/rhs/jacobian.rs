//! The stiff part of the equations of motion, for methods that are implicit in it: the friction of the
//! joints, D, the stabilizers of legs, (K_s, D_s), and the controller's forces on the head, J_h^T (K_p, D_h) J_h, within
//! one contact mode.
//!
//! With x = (r_q, r_v) and a = R tau for the accelerations a that torques tau cause in the mode,
//! (I - g A) k = r means k_q = r_q + g k_v and k_v = r_v - u, where within the mode's constraints
//!
//! ```text
//! (M + g D + g D_s + g^2 K_s + J^T (g D_h + g^2 K) J) u
//!     = g D r_v + (g D_s + g^2 K_s) r_v + g K_s r_q + J^T ((g D_h + g^2 K) J r_v + g K J r_q).
//! ```
//!
//! D_s and K_s are diagonal but for the torque on the hip, which depends on the pitch of the waist, p^T q. Its part of the
//! matrix has rank one; the formula of Sherman and Morrison (1950) solves with it.

use crate::{
    contact::equations::Slip,
    control::{
        head_force::{Feedback, feedback},
        joint::PITCH,
        joint_torques::{IMPLICIT, Slopes},
    },
    dynamics::{
        aba::ImplicitTerms,
        delassus::{FactoredDynamics, rows},
    },
    error::Termination,
    model::{Model, contact_mode::ContactMode, layout::NV},
    rhs::{Evaluation, StepContext},
};

fn dot(a: &[f64], b: &[f64]) -> f64 {
    a.iter().zip(b).map(|(a, b)| a * b).sum()
}

/// Rotation of the waist by a motion of the coordinates, p^T x.
fn pitch(x: &[f64]) -> f64 {
    x[PITCH].iter().sum()
}

/// The torque on the hip by the pitch of the waist.
#[derive(Debug, Clone, Copy)]
struct HipTorque {
    hip: usize,
    /// g d + g^2 k, with damping d and stiffness k by that pitch; and k.
    slope: f64,
    stiffness: f64,
    /// Accelerations by a unit torque.
    column: [f64; NV],
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
    /// K_s.
    stiffness: [f64; NV],
    /// g D_s + g^2 K_s.
    legs: [f64; NV],
    hip: Option<HipTorque>,
    /// Factorisations so far.
    pub count: u64,
}

impl Implicit {
    /// Factor the matrix of `solve` at the state (q, v) of the last evaluation of `eval`.
    ///
    /// # Errors
    /// `Singular`, where the contact equations have no solution.
    pub fn factor(
        &mut self,
        model: &Model,
        (eval, state): (&Evaluation, (&[f64; NV], &[f64; NV])),
        context: &StepContext,
        g: f64,
    ) -> Result<(), Termination> {
        let free = context.mode.free.touch;
        self.count += 1;
        self.g = g;
        self.mode = Some((context.mode, context.slip));
        let now = std::slice::from_ref(&context.now);
        let mut by_pitch = None;
        if let Some(mut slopes) = Slopes::of(model, &eval.kin, state, now) {
            by_pitch = slopes.take_hip();
            self.stiffness = slopes.stiffness;
            self.legs = slopes.implicit_part(g);
        }
        let terms = ImplicitTerms {
            g,
            legs: &self.legs,
        };
        self.factored
            .factor(model, &eval.kin, rows(free), eval.point, Some(terms));
        self.springs = feedback(model, &eval.kin, now, &mut self.feedback);
        let Feedback { K, D, J } = &self.feedback;
        let regular = !self.springs || self.factored.add_stiffness(model, J, g * (D + g * K));
        regular.then_some(()).ok_or(Termination::Singular)?;
        self.hip = None;
        if let Some(torque) = by_pitch {
            let slope = g * (torque.damping + g * torque.stiffness);
            let mut column = [0.0; NV];
            column[torque.hip] = 1.0;
            self.factored
                .apply_inverse(model, (context.mode, context.slip), &mut column)?;
            // Where the torque would drive the waist away, the method is explicit in it.
            self.hip = (slope * pitch(&column) > 0.0).then_some(HipTorque {
                hip: torque.hip,
                slope,
                stiffness: torque.stiffness,
                column,
            });
        }
        Ok(())
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
        if model.has_joint_torques {
            for c in IMPLICIT {
                u[c] += self.legs[c] * v[c] + g * self.stiffness[c] * q[c];
            }
        }
        if let Some(torque) = &self.hip {
            u[torque.hip] += torque.slope * pitch(v) + g * torque.stiffness * pitch(q);
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
        if let Some(HipTorque { slope, column, .. }) = &self.hip {
            let torque = slope * pitch(&u) / (1.0 + slope * pitch(column));
            for (u, z) in u.iter_mut().zip(column) {
                *u -= torque * z;
            }
        }
        for i in 0..v.len() {
            v[i] -= u[i];
            q[i] += g * v[i];
        }
        Ok(())
    }
}
