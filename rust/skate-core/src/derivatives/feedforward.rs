//! Derivatives of the feedforward torques by the times that they depend on.

use crate::{
    control::{feedforward, renumber_joints},
    derivatives::variation::Variation,
    model::{Model, controller_terms::Term, layout::NV, state::State},
    numeric::{dual::Dual, scalar::Scalar, trig::sin_cos_of},
};
use std::f64::consts::PI;

/// `control::feedforward_torque` for the controller of `state` at the time `t`, with the derivatives of the
/// controller's times and of the time itself.
pub fn feedforward_torque<R: Scalar>(
    model: &Model,
    (state, t): (&State, f64),
    varied: &Variation<R>,
) -> ([Dual<R>; NV], [Dual<R>; 2]) {
    let controller = &state.controller;
    let start = feedforward::start_of(controller.phase);
    let rate = |i: usize| R::of(PI) * (varied.t.d - varied.times[i].d);
    let angle = Dual {
        x: feedforward::phase(t, controller),
        d: rate(start),
    };
    let (sin, cos) = sin_cos_of(angle);
    let mut tau = [Dual::default(); NV];
    for term in &model.controller_terms {
        match term {
            Term::Feedforward(law) => {
                let scales = feedforward::scales(law).map(Dual::of);
                let tau7 = Dual::of(controller.tau7);
                feedforward::add(scales, controller.phase, (cos, tau7), &mut tau);
            }
            Term::ArmSwing { amplitude, yaw } => {
                let angle = Dual {
                    x: PI * (t - controller.t0),
                    d: rate(0),
                };
                let sign = Dual::of(controller.leg.sign() * amplitude);
                tau[*yaw] += sign * angle.sin();
            }
            _ => {}
        }
    }
    if controller.leg != state.support_leg {
        renumber_joints(&mut tau);
    }
    (tau, [sin, cos])
}
