//! Feedforward torques, Eqs. 16 to 22, period 2 s.

use crate::{
    control::ControllerInput,
    model::{
        Model,
        controller_state::{ControllerState, Phase, TICK_ROUNDING},
        layout::{FREE_FOOT, NV, ROOT, coordinate},
    },
    numeric::{elementary, scalar::Scalar},
    scene::Feedforward,
};
use std::f64::consts::PI;

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

/// Phase angle of the cosines in Eqs. 16 to 19 [rad]. It counts from the instant at which the active law
/// began; without one, from the leg swap.
#[inline(always)]
pub fn phase(t: f64, controller: &ControllerState) -> f64 {
    let times = [controller.t0, controller.t1, controller.t2];
    PI * (t - times[start_of(controller.phase)])
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

/// The factors `scale` and `tau1_scale` of the law.
pub fn scales(law: &Feedforward) -> [f64; 2] {
    [law.scale, law.tau1_scale]
}

/// tau += Eqs. 16 to 21; `cos` is the cosine of `phase`, `tau7` as last sampled.
#[inline(always)]
pub fn add<T: Scalar>(
    scales: [T; 2],
    phase: Option<Phase>,
    (cos, tau7): (T, T),
    tau: &mut [T; NV],
) {
    let (n, scale) = (T::of, scales[0]);
    // tau_i acts on coordinate q_i, which has the index i + 1.
    const FIRST: usize = ROOT - 2;
    match phase {
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
            tau[FIRST + 1] += tau1(scales, cos);
            tau[FIRST + 2] -= n(75.0) * wave;
            tau[FIRST + 5] += scale * n(30.0);
        }
        None => {}
    }
    tau[FIRST + 7] += tau7;
}

/// tau1 of Eq. 16 in the phase `PushOff`: a couple on the supporting foot, exerted from outside the robot. `cos`
/// is the cosine of `phase`.
#[inline(always)]
fn tau1<T: Scalar>([scale, tau1_scale]: [T; 2], cos: T) -> T {
    T::of(-100.0) * (tau1_scale * (scale * cos))
}

/// tau1 at the time `t` [N m]; 0 in the other phases.
pub fn tau1_at(law: &Feedforward, t: f64, controller: &ControllerState) -> f64 {
    match controller.phase {
        Some(Phase::PushOff) => tau1(scales(law), elementary::sin_cos(phase(t, controller)).1),
        _ => 0.0,
    }
}

/// tau += Eq. 22 with t_e = t0.
#[inline(never)]
pub fn tau8(amplitude: f64, now: &ControllerInput, tau: &mut f64) {
    let wave = elementary::sin(PI * (now.t - now.controller.t0));
    *tau += now.controller.leg.sign() * amplitude * wave;
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

/// Change of the mean of tau7 due to the controller's samples within a time step [N m]. The foot is light
/// and its joint friction is large, so between two samples the foot follows the torque alone; all other
/// torques on it are taken as constant.
#[inline(never)]
pub fn correct_tau7(
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
    let mut sample = ((start + TICK_ROUNDING) / period).floor();
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

/// tau7 as set by a controller sample [N m].
pub fn sampled_tau7(law: &Feedforward, phase: Option<Phase>, q_E: f64) -> f64 {
    law.scale * law.tau7_scale * tau7(phase, q_E)
}
