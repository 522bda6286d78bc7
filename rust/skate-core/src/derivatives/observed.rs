//! Derivatives of what an observation reads.

use crate::{
    control::ControllerInput,
    derivatives::variation::{Variation, state_size},
    model::{contact_mode::End, lanes::Broadcast, layout::NV},
    numeric::{dual::Dual, scalar::Scalar},
    rhs::{Evaluation, Stance, sole_points::SolePoints},
    sim::Simulation,
};

/// What an observation reads of a state.
#[derive(Debug, Clone, Copy)]
pub struct Observed<'a, T> {
    pub q: &'a [T; NV],
    pub v: &'a [T; NV],
    pub sole_points: &'a SolePoints<T>,
    /// Time since the last change of contact [s].
    pub since_event: T,
    /// Feedforward torques [N m], and sine and cosine of their phase angle; see `control::feedforward_torque`.
    pub torque: &'a [T; NV],
    pub wave: [T; 2],
}

impl<T: Scalar> Observed<'_, T> {
    /// Position of the hips, forward [m].
    pub fn hips(&self) -> T {
        self.q[0] + self.sole_points.waist
    }
}

/// Call `each` with the derivatives by every entry of the differentiated state.
pub fn observed(sim: &Simulation, mut each: impl FnMut(usize, &Observed<'_, Dual<f64>>)) {
    let (state, n) = (&sim.state, sim.model.n);
    let models = Broadcast(&sim.model);
    let now = ControllerInput::of(state);
    let mut eval = Box::<Evaluation<Dual<f64>>>::default();
    let stance = Stance::of(models, state.mode);
    for i in 0..state_size(n) {
        let mut varied = Variation::<f64>::of(state, &[0.0; NV]);
        varied.entry(n, i).d = 1.0;
        let (q, v) = (&varied.q, &varied.v);
        let (torque, wave) = varied
            .open_loop(&now.controller)
            .torques(models, now.mirrored);
        eval.update_kinematics(models, &stance, q, v);
        let on_heel = state.mode.support.touch.pivot() == End::Heel;
        let sole_points = &SolePoints::of(models, &eval.kin, on_heel, q[1]);
        let seen = Observed {
            q,
            v,
            sole_points,
            since_event: Dual::of(sim.since_event()),
            torque: &torque,
            wave,
        };
        each(i, &seen);
    }
}
