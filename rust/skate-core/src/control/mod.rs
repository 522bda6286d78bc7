//! Baseline controller: the terms that a scene names, one file a term. A file has the torque of its term, what the
//! sampled controller keeps for it, and the slopes of the torque by positions and velocities, which the implicit
//! methods and the gradients use. The matches here, in `joint_torques` and in `head_force` name every term.

pub mod arm_swing;
pub mod feedforward;
pub mod free_knee_pd;
pub mod head;
pub mod head_damping;
pub mod head_force;
pub mod hip_pd;
pub mod joint;
pub mod joint_torques;
pub mod knee_stop;
pub mod lifting;

use crate::{
    dynamics::kinematics::Kinematics,
    model::{
        Model,
        contact_mode::ContactMode,
        controller_state::{ControllerState, Phase},
        controller_terms::Term,
        lanes::ModelLanes,
        layout::{LEG, NV, ROOT, reverse_legs},
        state::State,
    },
    numeric::{
        scalar::{MAX_LANES, Scalar},
        trig::sin_cos_of,
    },
    scene::Leg,
};
use joint::JointInput;
use std::f64::consts::PI;

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
            Term::Feedforward(law) => feedforward::sample(law, mode, angle, controller),
            Term::FreeKneePd(_) => free_knee_pd::sample(mode, controller),
            Term::Lifting(_) | Term::HeadDamping(_) => head_force::sample(mode, controller),
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
    let input = JointInput { q, v, now };
    // Joints are numbered from the foot that the controller treats as the supporting one.
    for (i, term) in models.shape().controller_terms.iter().enumerate() {
        match term {
            Term::Feedforward(_) | Term::ArmSwing { .. } => {}
            Term::Lifting(_) | Term::HeadDamping(_) => {
                head_force::add_term(models, (i, term), kin, (q[1], v), now, tau);
            }
            Term::HipPd(_) | Term::FreeKneePd(_) | Term::KneeStop(_) => {
                joint_torques::each_torque(
                    &input,
                    models,
                    (i, term),
                    kin,
                    #[inline(always)]
                    |torque| tau[torque.c] += torque.torque,
                );
            }
        }
    }
    if now[0].mirrored {
        renumber_joints(tau);
    }
}

/// Coordinates up to q8: the open-loop torques act on no others.
const UP_TO_Q8: usize = LEG + 1;

/// What the open-loop torques, Eqs. 16 to 22, depend on.
#[derive(Debug, Clone, Copy)]
pub struct OpenLoop<T> {
    pub phase: Option<Phase>,
    leg: Leg,
    /// The time, and t0, t1 and t2 of the controller [s].
    t: T,
    pub times: [T; 3],
    /// tau7 as last sampled [N m].
    tau7: T,
}

impl<T: Scalar> OpenLoop<T> {
    #[inline(always)]
    pub fn of(controller: &ControllerState, t: T, times: [T; 3], tau7: T) -> Self {
        Self {
            phase: controller.phase,
            leg: controller.leg,
            t,
            times,
            tau7,
        }
    }

    /// Of an input without derivatives.
    #[inline(always)]
    pub fn at(now: &ControllerInput) -> Self {
        let controller = &now.controller;
        let times = [controller.t0, controller.t1, controller.t2].map(T::of);
        Self::of(controller, T::of(now.t), times, T::of(controller.tau7))
    }

    #[inline(always)]
    fn angle(&self, since: usize) -> T {
        T::of(PI) * (self.t - self.times[since])
    }

    /// Phase angle of the cosines in Eqs. 16 to 19 [rad]. It counts from the instant at which the active law began;
    /// without one, from the leg swap.
    #[inline(always)]
    fn law_angle(&self) -> T {
        self.angle(feedforward::start_of(self.phase))
    }

    /// Add the torques, with the joints numbered as the controller does; `cos` is the cosine of `law_angle`.
    #[inline(always)]
    fn add(&self, models: impl ModelLanes<T>, cos: T, tau: &mut [T; UP_TO_Q8]) {
        for (i, term) in models.shape().controller_terms.iter().enumerate() {
            match term {
                Term::Feedforward(_) => feedforward::add_torques(models, i, (self, cos), tau),
                Term::ArmSwing { yaw, .. } => tau[*yaw] += arm_swing::torque(models, i, self),
                // They depend on positions and velocities.
                Term::Lifting(_) | Term::HeadDamping(_) => {}
                Term::HipPd(_) | Term::FreeKneePd(_) | Term::KneeStop(_) => {}
            }
        }
    }

    /// The torques, with the joints numbered as the controller does, or in the present numbering of a `mirrored` one;
    /// sine and cosine of `law_angle`.
    #[inline(always)]
    pub fn torques(&self, models: impl ModelLanes<T>, mirrored: bool) -> ([T; NV], [T; 2]) {
        let (sin, cos) = sin_cos_of(self.law_angle());
        let mut tau = [T::zero(); UP_TO_Q8];
        self.add(models, cos, &mut tau);
        let mut tau = all_coordinates(&tau);
        if mirrored {
            renumber_joints(&mut tau);
        }
        (tau, [sin, cos])
    }
}

/// Open-loop torques with the joints numbered as the controller does.
#[inline(always)]
pub fn open_loop_torques<T: Scalar>(
    models: impl ModelLanes<T>,
    now: &[ControllerInput],
) -> [T; NV] {
    let mut cos = T::zero();
    if feedforward::term(models.shape()).is_some() {
        let phases = T::from_lanes(|i| OpenLoop::at(&now[i]).law_angle());
        cos = sin_cos_of(phases).1;
    }
    if T::LANES == 1 {
        let mut tau = [0.0; UP_TO_Q8];
        add_open_loop(models.lane(0), &now[0], cos.lane(0), &mut tau);
        return all_coordinates(&tau.map(T::of));
    }
    let mut rows = [[0.0; UP_TO_Q8]; MAX_LANES];
    for (i, tau) in rows[..T::LANES].iter_mut().enumerate() {
        add_open_loop(models.lane(i), &now[i], cos.lane(i), tau);
    }
    let mut tau = [T::zero(); UP_TO_Q8];
    T::from_rows(&rows.each_ref(), &mut tau);
    all_coordinates(&tau)
}

#[inline(always)]
fn all_coordinates<T: Scalar>(up_to_q8: &[T; UP_TO_Q8]) -> [T; NV] {
    let mut tau = [T::zero(); NV];
    tau[..UP_TO_Q8].copy_from_slice(up_to_q8);
    tau
}

/// The torques of one lane.
#[inline(never)]
fn add_open_loop(model: &Model, now: &ControllerInput, cos: f64, tau: &mut [f64; UP_TO_Q8]) {
    OpenLoop::at(now).add(model, cos, tau);
}

/// Convert torques numbered from the free foot to the numbering from the supporting foot.
pub fn renumber_joints<T: Scalar>(tau: &mut [T; NV]) {
    reverse_legs(tau);
    // tau1 is a couple on the free foot; in the other numbering it acts at every joint of the chain.
    let couple = tau[2];
    tau[ROOT..LEG].iter_mut().for_each(|tau| *tau += couple);
}

/// Open-loop torques at a state [N m], with sine and cosine of the phase angle of Eqs. 16 to 19.
pub fn feedforward_torque(model: &Model, state: &State) -> ([f64; NV], [f64; 2]) {
    let now = ControllerInput::of(state);
    OpenLoop::at(&now).torques(model, now.mirrored)
}
