//! Derivatives of what an observation reads.

use crate::{
    control::ControllerInput,
    derivatives::variation::{Variation, state_size},
    model::{Model, contact_mode::End, lanes::Broadcast, layout::NV, state::State},
    numeric::dual::Dual,
    rhs::{Evaluation, Stance, sole_points::SolePoints},
};

/// Quantities of a state with their derivatives along one direction.
#[derive(Debug, Clone)]
pub struct Observed {
    pub q: [Dual<f64>; NV],
    pub v: [Dual<f64>; NV],
    pub sole_points: SolePoints<Dual<f64>>,
    /// Feedforward torques [N m], and sine and cosine of their phase angle; see `control::feedforward_torque`.
    pub torque: [Dual<f64>; NV],
    pub wave: [Dual<f64>; 2],
}

impl Observed {
    /// Position of the hips, forward [m].
    pub fn hips(&self) -> Dual<f64> {
        self.q[0] + self.sole_points.waist
    }
}

/// Call `each` with the derivatives by every entry of the differentiated state.
pub fn observed(model: &Model, state: &State, mut each: impl FnMut(usize, &Observed)) {
    let n = model.n;
    let now = ControllerInput::of(state);
    let mut eval = Box::<Evaluation<Dual<f64>>>::default();
    let stance = Stance::of(Broadcast(model), state.mode);
    for i in 0..state_size(n) {
        let mut varied = Variation::<f64>::of(state, &[0.0; NV]);
        varied.entry(n, i).d = 1.0;
        let input = varied.open_loop(&now.controller);
        let (torque, wave) = input.torques(Broadcast(model), now.mirrored);
        eval.update_kinematics(Broadcast(model), &stance, &varied.q, &varied.v);
        let on_heel = state.mode.support.touch.pivot() == End::Heel;
        let seen = Observed {
            sole_points: SolePoints::of(Broadcast(model), &eval.kin, on_heel, varied.q[1]),
            q: varied.q,
            v: varied.v,
            torque,
            wave,
        };
        each(i, &seen);
    }
}
