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
//! D_s and K_s are diagonal but for the torque on the hip, which depends on the pitch of the waist. It adds a matrix of
//! rank one, e p^T, which the formula of Sherman and Morrison (1950) removes.

use crate::{
    contact::equations::Slip,
    control::{
        lifting::{Feedback, feedback},
        stabilizers::Resistance,
    },
    dynamics::delassus::{FactoredDynamics, rows},
    error::Termination,
    model::{
        Model,
        contact_mode::ContactMode,
        layout::{LEG, NV, ROOT, WAIST, coordinate},
    },
    rhs::{Evaluation, StepContext},
};

fn dot(a: &[f64], b: &[f64]) -> f64 {
    a.iter().zip(b).map(|(a, b)| a * b).sum()
}

/// Rotation of the waist by a motion of the coordinates, p^T x.
fn pitch(x: &[f64]) -> f64 {
    x[2..=coordinate(WAIST)].iter().sum()
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
    /// Slopes of the stabilizers' torques, if the controller has any for the legs.
    resistance: Option<Resistance<f64>>,
    /// Accelerations by a unit torque on the hip, and g D_s + g^2 K_s and K_s of its torque by the waist's pitch.
    hip: ([f64; NV], [f64; 2]),
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
        self.resistance = model
            .has_leg_stabilizers
            .then(|| Resistance::of(model, &eval.kin, state, now));
        if let Some(resistance) = &self.resistance {
            self.factored.tree.added = resistance.implicit_part(g);
            self.factored.tree.added[resistance.hip] = 0.0;
        }
        self.factored
            .factor(model, &eval.kin, (rows(free), eval.point), Some(g));
        self.springs = feedback(model, &eval.kin, now, &mut self.feedback);
        let Feedback { K, D, J } = &self.feedback;
        let regular = !self.springs || self.factored.add_stiffness(model, J, g * (D + g * K));
        regular.then_some(()).ok_or(Termination::Singular)?;
        self.factor_hip(model)
    }

    /// The part of the matrix of rank one. It is left out where the torque would drive the waist away, which makes the
    /// method explicit in it.
    fn factor_hip(&mut self, model: &Model) -> Result<(), Termination> {
        self.hip.1 = [0.0; 2];
        let mode = self.mode.expect("set by `factor`");
        let Some(resistance) = self.resistance.as_ref().filter(|r| r.acts_on_hip()) else {
            return Ok(());
        };
        let (column, slopes) = (&mut self.hip.0, resistance.hip_slopes(self.g));
        *column = [0.0; NV];
        column[resistance.hip] = 1.0;
        self.factored.apply_inverse(model, mode, column)?;
        if slopes[0] * pitch(column) > 0.0 {
            self.hip.1 = slopes;
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
        let (column, [slope, stiffness]) = (&self.hip.0, self.hip.1);
        let mut u = [0.0; NV];
        for c in model.damped.clone() {
            u[c] = g * model.damping[c] * v[c];
        }
        if let Some(resistance) = &self.resistance {
            let part = resistance.implicit_part(g);
            for c in (ROOT..LEG).filter(|&c| c != resistance.hip) {
                u[c] += part[c] * v[c] + g * resistance.stiffness[c] * q[c];
            }
            u[resistance.hip] += slope * pitch(v) + g * stiffness * pitch(q);
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
        if slope != 0.0 {
            let removed = slope * pitch(&u) / (1.0 + slope * pitch(column));
            for (u, z) in u.iter_mut().zip(column) {
                *u -= removed * z;
            }
        }
        for i in 0..v.len() {
            v[i] -= u[i];
            q[i] += g * v[i];
        }
        Ok(())
    }
}
