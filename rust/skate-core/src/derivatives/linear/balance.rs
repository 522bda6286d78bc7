//! What the equations of motion, impacts and guards read from the model, as functions of it at a fixed state. Their
//! differences between models of several parameters are explicit derivatives.

use crate::{
    contact::equations::{Slip, Solution, Y, Z},
    control::{self, ControllerInput},
    derivatives::linear::loads::Chain,
    events::guard::Guard,
    model::{
        Model,
        contact_mode::{ContactMode, Foot},
        layout::{FREE_FOOT, LEG, NV},
    },
    rhs::{Evaluation, ankle_to_point},
};
use nalgebra::Vector3;

/// Numbers of `Balance::equations`: loads on the coordinates, acceleration of the free foot's contact point, and
/// friction forces of both feet.
pub const EQUATIONS: usize = NV + 4;

/// A state with accelerations and contact forces that satisfy the equations of motion. Of an impact or a projection
/// these are the changes of the velocities or positions and the impulses.
#[derive(Debug, Clone, Copy)]
pub struct Balance<'a> {
    pub mode: ContactMode,
    /// Whether sliding feet have friction.
    pub has_friction: bool,
    pub q: &'a [f64; NV],
    pub v: &'a [f64; NV],
    pub a: &'a [f64; NV],
    pub f_root: Vector3<f64>,
    pub lam: Vector3<f64>,
}

impl Balance<'_> {
    /// Forces along y on the supporting and on the free foot under the given normal forces.
    fn friction(&self, model: &Model) -> [f64; 2] {
        let Slip { support, free } = Slip::of(model, self.mode);
        let along = |foot: Foot, ratio: f64, force: &Vector3<f64>| {
            if self.has_friction && foot.slides() {
                -ratio * force[Z]
            } else {
                force[Y]
            }
        };
        [
            along(self.mode.support, support, &self.f_root),
            along(self.mode.free, free, &self.lam),
        ]
    }

    /// Contact forces minus damping and inverse dynamics, by coordinate. Constant parts are left out.
    fn forces(&self, model: &Model, eval: &mut Evaluation) -> [f64; NV] {
        eval.full_kinematics(model, self.mode.support.touch, self.q, self.v);
        eval.point = (eval.kin).sole_point(model, ankle_to_point(model, self.mode.free.touch));
        let mut forces = [0.0; NV];
        (eval.inertias).inverse_dynamics(model, &eval.kin, self.a, &mut forces);
        forces[..model.n]
            .iter_mut()
            .for_each(|force| *force *= -1.0);
        for c in model.damped.clone() {
            forces[c] -= model.damping[c] * self.v[c];
        }
        let [support, free] = self.friction(model);
        forces[0] += support + free;
        let chain = Chain::of(&eval.kin, eval.point);
        for c in 2..LEG {
            let [y, z] = chain.motion(c);
            forces[c] += y * free + z * self.lam[Z];
        }
        forces
    }

    /// `forces` at rest without gravity, as for impacts and projections.
    pub fn forces_at_rest(&self, model: &Model, eval: &mut Evaluation) -> [f64; NV] {
        let mut a = *self.a;
        a[1] -= model.scene.ice.gravity;
        let rest = Balance {
            v: &[0.0; NV],
            a: &a,
            ..*self
        };
        rest.forces(model, eval)
    }

    /// See `EQUATIONS`; `now` is the controller's input.
    pub fn equations(
        &self,
        model: &Model,
        now: &ControllerInput,
        eval: &mut Evaluation,
    ) -> [f64; EQUATIONS] {
        let forces = self.forces(model, eval);
        let torques = control::baseline(model, &mut eval.kin, self.v, self.q, now);
        let at = Vector3::new(0.0, eval.point.y, eval.point.z);
        let bias = eval.kin.point_bias(FREE_FOOT, &at);
        let mut point = [bias.y, bias.z];
        let chain = Chain::of(&eval.kin, eval.point);
        for c in 2..LEG {
            let motion = chain.motion(c);
            point = [0, 1].map(|i| point[i] + motion[i] * self.a[c]);
        }
        let mut all = [0.0; EQUATIONS];
        for c in 0..model.n {
            all[c] = forces[c] + torques[c];
        }
        all[NV..NV + 2].copy_from_slice(&point);
        all[NV + 2..].copy_from_slice(&self.friction(model));
        all
    }

    /// Value of a guard.
    pub fn guard(&self, guard: Guard, model: &Model, eval: &mut Evaluation) -> f64 {
        eval.set_planar_configuration(model, self.mode, self.q, self.v);
        eval.solution = Solution {
            f_root: self.f_root,
            lam: self.lam,
            ..Solution::default()
        };
        guard.value(model, eval, self.mode, (self.q[1], self.v[0]))
    }
}

/// Input of the controller under another model: the torque that it has sampled is proportional to the feedforward's
/// scale.
pub fn input_of(now: &ControllerInput, model: &Model, other: &Model) -> ControllerInput {
    let scale = |model: &Model| {
        let law = model.scene.control.feedforward.as_ref();
        law.map_or(0.0, |law| law.scale * law.tau7_scale)
    };
    let mut input = *now;
    if input.controller.tau7 != 0.0 {
        input.controller.tau7 *= scale(other) / scale(model);
    }
    input
}

/// Position and velocity along y and z of the point of the free foot's sole at the distance `along` in front of the
/// ankle.
pub fn sole_point(
    model: &Model,
    eval: &mut Evaluation,
    (mode, along): (ContactMode, f64),
    (q, v): (&[f64; NV], &[f64; NV]),
) -> [f64; 4] {
    eval.set_leg_configuration(model, mode, q, v);
    let at = eval.kin.sole_point(model, along);
    let velocity = eval
        .kin
        .point_velocity(FREE_FOOT, &Vector3::new(0.0, at.y, at.z));
    [at.y, at.z, velocity.y, velocity.z]
}
