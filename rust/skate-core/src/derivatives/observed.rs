//! Derivatives of what an observation reads.

use crate::{
    control::ControllerInput,
    derivatives::variation::{Variation, state_size},
    events::leg_swap::translate_pivot,
    model::{contact_mode::End, lanes::Broadcast, layout::NV, state::State},
    numeric::{dual::Dual, scalar::Scalar, trig::sin_cos_of},
    rhs::{Evaluation, Stance, sole_points::SolePoints},
    sim::{Coordinates, Simulation},
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
    let on_heel = state.mode.support.touch.pivot() == End::Heel;
    let Coordinates { q, v } = sim.coordinates();
    let of_toe = State { q, v, ..*state };
    for i in 0..state_size(n) {
        let mut varied = Variation::<f64>::of(&of_toe, &[0.0; NV]);
        varied.entry(n, i).d = 1.0;
        if on_heel {
            let along = Dual::of(-sim.model.sole.length());
            let turn = sin_cos_of(varied.q[2]);
            translate_pivot(along, turn, &mut varied.q, &mut varied.v);
        }
        let (q, v) = (&varied.q, &varied.v);
        let (torque, wave) = varied
            .open_loop(&now.controller)
            .torques(models, now.mirrored);
        eval.update_kinematics(models, &stance, q, v);
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
