//! Baseline controller: feedforward, visual lifting, and the stabilizers that a scene enables.

pub mod feedforward;
pub mod lifting;
pub mod stabilizers;

use crate::{
    dynamics::kinematics::Kinematics,
    model::{
        Model,
        contact_mode::{ContactMode, SoleContact},
        controller_state::{ControllerState, Phase},
        controller_terms::Term,
        lanes::ModelLanes,
        layout::{FREE_FOOT, LEG, NV, ROOT, coordinate, reverse_legs},
        state::State,
    },
    numeric::{
        scalar::{MAX_LANES, Mask, Scalar},
        trig::sin_cos_of,
    },
    scene::Leg,
};
use feedforward::AnkleMotion;

/// Controller state after a sample at `state`: the active laws, and tau7 of Eq. 21 for the free foot's
/// angle to the ice `angle` [rad].
pub fn sampled(model: &Model, state: &State, angle: f64) -> ControllerState {
    let mut controller = state.controller;
    let now = (state.t, state.support_leg, state.mode);
    sample(model, now, angle, &mut controller);
    controller
}

/// Sample in place, at the time `t` [s] on the supporting leg `leg` in the contact mode `mode`.
#[inline(always)]
pub fn sample(
    model: &Model,
    (t, leg, mode): (f64, Leg, ContactMode),
    angle: f64,
    controller: &mut ControllerState,
) {
    if controller.leg != leg {
        (controller.leg, controller.t0) = (leg, t);
    }
    for term in &model.controller_terms {
        match term {
            Term::Feedforward(law) => {
                controller.phase = Phase::of(mode);
                controller.tau7 = feedforward::sampled_tau7(law, controller.phase, angle);
            }
            Term::FreeKneePd(_) => controller.phase = Phase::of(mode),
            Term::Lifting(_) | Term::HeadDamping(_) => {
                controller.supported = mode.support.touch != SoleContact::Air;
            }
            Term::ArmSwing { .. } | Term::HipPd(_) | Term::KneeStop(_) => {}
        }
    }
}

/// Input of the controller besides positions and velocities.
#[derive(Debug, Clone, Copy)]
pub struct ControllerInput {
    pub t: f64,
    pub controller: ControllerState,
    /// The controller's supporting leg is the present free leg.
    pub mirrored: bool,
}

impl ControllerInput {
    /// Input at a state.
    pub fn of(state: &State) -> Self {
        Self {
            t: state.t,
            controller: state.controller,
            mirrored: state.controller.leg != state.support_leg,
        }
    }
}

/// All torques of the baseline [N m]; entries 0 and 1 are forces on y0 and z0 [N]. Needs
/// `Kinematics::frames` and `planar_velocities`.
pub fn baseline(
    model: &Model,
    kin: &mut Kinematics,
    v: &[f64; NV],
    q: &[f64; NV],
    now: &ControllerInput,
) -> [f64; NV] {
    let now = std::slice::from_ref(now);
    let mut tau = open_loop_torques(model, now);
    add_feedback(model, kin, (q, v), now, &mut tau);
    tau
}

/// Add the state-dependent torques to the open-loop ones. `now` holds one input per lane; either all of
/// them are mirrored or none.
#[inline(always)]
pub fn add_feedback<T: Scalar>(
    models: impl ModelLanes<T>,
    kin: &mut Kinematics<T>,
    (q, v): (&[T; NV], &[T; NV]),
    now: &[ControllerInput],
    tau: &mut [T; NV],
) {
    // Joints are numbered from the foot that the controller treats as the supporting one.
    for (i, term) in models.shape().controller_terms.iter().enumerate() {
        match term {
            Term::Feedforward(_) | Term::ArmSwing { .. } => {}
            Term::Lifting(_) => lifting::lift(models, kin, i, q[1], now, tau),
            Term::HeadDamping(_) => lifting::damp(models, kin, i, v, now, tau),
            Term::HipPd(_) => stabilizers::hip_pd(models, i, kin, tau),
            Term::FreeKneePd(_) => stabilizers::free_knee_pd(models, i, (q, v), now, tau),
            Term::KneeStop(_) => stabilizers::knee_stop(models, i, (q, v), now, tau),
        }
    }
    if now[0].mirrored {
        renumber_joints(tau);
    }
}

/// Open-loop torques, Eqs. 16 to 22, which depend on time only, with the joints numbered as the controller
/// does.
#[inline(always)]
pub fn open_loop_torques<T: Scalar>(
    models: impl ModelLanes<T>,
    now: &[ControllerInput],
) -> [T; NV] {
    let terms = &models.shape().controller_terms;
    let mut cos = T::zero();
    if terms.iter().any(|t| matches!(t, Term::Feedforward(_))) {
        let phases = T::from_lanes(|i| feedforward::phase(now[i].t, &now[i].controller));
        cos = sin_cos_of(phases).1;
    }
    if T::LANES == 1 {
        let mut tau = [0.0; NV];
        add_feedforward(models.lane(0), &now[0], cos.lane(0), &mut tau);
        return tau.map(T::of);
    }
    let mut rows = [[0.0; NV]; MAX_LANES];
    for (i, tau) in rows[..T::LANES].iter_mut().enumerate() {
        add_feedforward(models.lane(i), &now[i], cos.lane(i), tau);
    }
    let mut tau = [T::zero(); NV];
    T::from_rows(&rows.each_ref(), &mut tau);
    tau
}

/// `cos` is the cosine of `feedforward::phase`.
#[inline(never)]
fn add_feedforward(model: &Model, now: &ControllerInput, cos: f64, tau: &mut [f64; NV]) {
    for term in &model.controller_terms {
        match term {
            Term::Feedforward(law) => {
                let controller = &now.controller;
                let scales = feedforward::scales(law);
                feedforward::add(scales, controller.phase, (cos, controller.tau7), tau);
            }
            Term::ArmSwing { amplitude, yaw } => feedforward::tau8(*amplitude, now, &mut tau[*yaw]),
            _ => {}
        }
    }
}

/// Add the effect of the controller's samples within a time step to the open-loop torques of the step.
#[inline(always)]
pub fn add_tau7_correction<T: Scalar>(
    models: impl ModelLanes<T>,
    now: &[ControllerInput],
    motion: &AnkleMotion<T>,
    tau: &mut [T; NV],
) {
    let terms = &models.shape().controller_terms;
    let law = terms.iter().position(|t| matches!(t, Term::Feedforward(_)));
    let Some(law) = law.filter(|_| !now[0].mirrored) else {
        return;
    };
    let near = motion.near_switch();
    let tau7 = &mut tau[coordinate(FREE_FOOT)];
    for i in 0..T::LANES {
        let model = models.lane(i);
        if near.lane(i)
            && let Term::Feedforward(law) = &model.controller_terms[law]
        {
            let change = feedforward::correct_tau7(model, law, &now[i], &motion.lane(i));
            tau7.set_lane(i, tau7.lane(i) + change);
        }
    }
}

/// Convert torques numbered from the free foot to the numbering from the supporting foot.
pub fn renumber_joints<T: Scalar>(tau: &mut [T; NV]) {
    reverse_legs(tau);
    // tau1 is a couple on the free foot; in the other numbering it acts at every joint of the chain.
    let couple = tau[2];
    tau[ROOT..LEG].iter_mut().for_each(|tau| *tau += couple);
}

/// Feedforward torques, Eqs. 16 to 22, at a state [N m], with sine and cosine of the phase angle of Eqs. 16
/// to 19.
pub fn feedforward_torque(model: &Model, state: &State) -> ([f64; NV], [f64; 2]) {
    let now = ControllerInput::of(state);
    let (sin, cos) = sin_cos_of(feedforward::phase(now.t, &now.controller));
    let mut tau = [0.0; NV];
    add_feedforward(model, &now, cos, &mut tau);
    if now.mirrored {
        renumber_joints(&mut tau);
    }
    (tau, [sin, cos])
}
