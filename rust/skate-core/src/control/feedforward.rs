//! Feedforward torques, Eqs. 16 to 22, period 2 s.

use crate::{
    control::{ControllerInput, OpenLoop, UP_TO_Q8},
    model::{
        Model,
        contact_mode::ContactMode,
        controller_state::{ControllerState, Phase, tick_rounding},
        controller_terms::Term,
        lanes::ModelLanes,
        layout::{FREE_FOOT, NV, ROOT, coordinate},
        state::State,
    },
    numeric::scalar::{Mask, Scalar},
    scene::Feedforward,
};

/// tau_i acts on coordinate q_i, which has the index FIRST + i.
const FIRST: usize = ROOT - 2;
/// Angle of the free foot at which tau7 changes sign during the swing, Eq. 21 [rad].
pub const Q_E_SWING: f64 = 0.25;

/// tau7 of Eq. 21 [N m] for the free foot's angle to the ice `q_E` [rad]. The controller samples it; it is
/// not continuous.
pub fn tau7(phase: Option<Phase>, q_E: f64) -> f64 {
    match phase {
        Some(Phase::Swing) if q_E < Q_E_SWING => 50.0,
        Some(Phase::Swing) => -30.0,
        Some(Phase::Touched) if q_E > 0.0 => 40.0,
        _ => 0.0,
    }
}

/// Index of the time t_0, t_1 or t_2 at which the law of a phase began.
#[inline(always)]
pub fn start_of(phase: Option<Phase>) -> usize {
    match phase {
        Some(Phase::Touched) => 1,
        Some(Phase::PushOff) => 2,
        Some(Phase::Swing) | None => 0,
    }
}

/// Index of the term, if the controller has it.
#[inline(always)]
pub fn term(model: &Model) -> Option<usize> {
    let mut terms = model.controller_terms.iter();
    terms.position(|term| matches!(term, Term::Feedforward(_)))
}

#[inline(always)]
fn number<T: Scalar>(models: impl ModelLanes<T>, i: usize, of: fn(&Feedforward) -> f64) -> T {
    models.number(|m| match &m.controller_terms[i] {
        Term::Feedforward(law) => of(law),
        _ => 0.0,
    })
}

/// Factor on tau7 of term `i`.
pub fn tau7_scale<T: Scalar>(models: impl ModelLanes<T>, i: usize) -> T {
    number(models, i, |law| law.scale * law.tau7_scale)
}

/// Sample the phase and tau7, for the free foot's angle to the ice `angle` [rad].
#[inline(always)]
pub fn sample(law: &Feedforward, mode: ContactMode, angle: f64, controller: &mut ControllerState) {
    controller.phase = Phase::of(mode);
    controller.tau7 = sampled_tau7(law, controller.phase, angle);
}

/// tau7 as set by a controller sample [N m].
fn sampled_tau7(law: &Feedforward, phase: Option<Phase>, q_E: f64) -> f64 {
    law.scale * law.tau7_scale * tau7(phase, q_E)
}

/// tau += Eqs. 16 to 21, by term `i`; `cos` is the cosine of the law's phase angle.
#[inline(always)]
pub fn add_torques<T: Scalar>(
    models: impl ModelLanes<T>,
    i: usize,
    (input, cos): (&OpenLoop<T>, T),
    tau: &mut [T; UP_TO_Q8],
) {
    let n = T::of;
    let scale = number(models, i, |law| law.scale);
    match input.phase {
        Some(Phase::Swing) => {
            tau[FIRST + 5] += scale * (n(50.0) * cos);
            tau[FIRST + 6] += scale * n(20.0);
        }
        Some(Phase::Touched) => {
            let wave = scale * cos;
            tau[FIRST + 2] -= n(205.0) * wave;
            tau[FIRST + 3] -= n(50.0) * wave;
            tau[FIRST + 5] += n(100.0) * wave;
        }
        Some(Phase::PushOff) => {
            let wave = scale * cos;
            tau[FIRST + 1] += n(-100.0) * (number(models, i, |law| law.tau1_scale) * wave);
            tau[FIRST + 2] -= n(75.0) * wave;
            tau[FIRST + 5] += scale * n(30.0);
        }
        None => {}
    }
    tau[FIRST + 7] += input.tau7;
}

/// tau1 at a state [N m]: a couple on the supporting foot, exerted from outside the robot.
pub fn tau1(model: &Model, state: &State) -> f64 {
    match state.controller.phase {
        Some(Phase::PushOff) => {
            let now = ControllerInput::of(state);
            OpenLoop::at(&now).torques(model, false).0[FIRST + 1]
        }
        Some(Phase::Swing | Phase::Touched) | None => 0.0,
    }
}

/// Rotation of the free foot during a time step, for a constant tau7.
#[derive(Debug, Clone, Copy)]
pub struct AnkleMotion<T> {
    /// Time step [s].
    pub h: T,
    /// Angle of the free foot to the ice at the middle of the step [rad].
    pub angle: T,
    /// Rate of that angle at both ends of the step [rad/s].
    pub rates: [T; 2],
    /// 1 / (I + h/2 d): I is the inertia that the ankle moves, d its friction.
    pub inverse: T,
}

impl<T: Scalar> AnkleMotion<T> {
    /// Whether the foot may reach an angle at which tau7 changes.
    #[inline(always)]
    pub fn near_switch(&self) -> T::Mask {
        let [before, after] = self.rates;
        let reach = self.h * before.abs().simd_max(after.abs());
        let near = |angle: f64| (self.angle - T::of(angle)).abs().le(reach);
        near(Q_E_SWING) | near(0.0)
    }

    /// Values of lane `i`.
    #[inline(always)]
    pub fn lane(&self, i: usize) -> AnkleMotion<f64> {
        AnkleMotion {
            h: self.h.lane(i),
            angle: self.angle.lane(i),
            rates: self.rates.map(|rate| rate.lane(i)),
            inverse: self.inverse.lane(i),
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
    let Some(law) = term(models.shape()).filter(|_| !now[0].mirrored) else {
        return;
    };
    let near = motion.near_switch();
    let tau7 = &mut tau[coordinate(FREE_FOOT)];
    for i in 0..T::LANES {
        let model = models.lane(i);
        if near.lane(i)
            && let Term::Feedforward(law) = &model.controller_terms[law]
        {
            let change = correct_tau7(model, law, &now[i], &motion.lane(i));
            tau7.set_lane(i, tau7.lane(i) + change);
        }
    }
}

/// Change of the mean of tau7 due to the controller's samples within a time step [N m]. The foot is light
/// and its joint friction is large, so between two samples the foot follows the torque alone; all other
/// torques on it are taken as constant.
#[inline(never)]
fn correct_tau7(
    model: &Model,
    law: &Feedforward,
    now: &ControllerInput,
    motion: &AnkleMotion<f64>,
) -> f64 {
    let AnkleMotion {
        h,
        angle,
        rates: [before, after],
        inverse,
    } = *motion;
    let (held, friction) = (now.controller.tau7, model.damping[coordinate(FREE_FOOT)]);
    let inertia = (1.0 / inverse - 0.5 * h * friction).max(f64::EPSILON / inverse);
    // Remaining torque on the foot.
    let rest = inertia * (after - before) / h + friction * 0.5 * (before + after) - held;
    let period = model.scene.control.sample_period;
    let start = now.t - 0.5 * h;
    let mut sample = ((start + tick_rounding(start)) / period).floor();
    let (mut angle, mut rate) = (angle - 0.5 * h * before, before);
    let (mut time, mut tau, mut impulse) = (0.0, held, 0.0);
    loop {
        sample += 1.0;
        let next = sample * period - start;
        if next >= h {
            return (impulse + tau * (h - time)) / h - held;
        }
        let dt = next - time;
        let half = 0.5 * dt * friction;
        let new = ((inertia - half) * rate + dt * (rest + tau)) / (inertia + half);
        angle += 0.5 * dt * (rate + new);
        impulse += tau * dt;
        (time, rate) = (next, new);
        tau = sampled_tau7(law, now.controller.phase, angle);
    }
}
