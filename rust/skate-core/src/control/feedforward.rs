//! The printed torques, Eqs. 16 to 22, period 2 s.

use super::Situation;
use crate::{
    contact::{Mode, Touch},
    model::{NV, ROOT},
    scene::Feedforward,
};
use serde::{Deserialize, Serialize};
use std::f64::consts::PI;

/// Which of the printed laws apply. The paper names states 3, 7, 14 and 16; the others take the law
/// of the state that differs from them only by sticking or by the supporting foot's rotation.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
pub enum Phase {
    /// States 1 to 4, printed for 3: the free foot is in the air.
    Swing,
    /// States 5 to 12, printed for 7: it touches at a point.
    Touched,
    /// States 14, 16, 18, 20, printed for 14 and 16: it is flat and the support rotates.
    PushOff,
}

impl Phase {
    /// States 13, 15, 17 and 19 have no law, nor has a robot in the air.
    pub fn of(mode: Mode) -> Option<Self> {
        match (mode.support.touch, mode.free.touch) {
            (Touch::Air, _) => None,
            (_, Touch::Air) => Some(Self::Swing),
            (_, Touch::Heel | Touch::Toe) => Some(Self::Touched),
            (Touch::Flat, Touch::Flat) => None,
            (_, Touch::Flat) => Some(Self::PushOff),
        }
    }
}

/// Angle of the free foot at which tau7 turns round in the swing, Eq. 21 [rad].
pub const Q_E_SWING: f64 = 0.25;

/// tau7 of Eq. 21 for the free foot's angle to the ground `q_E` [rad]; sampled, not continuous.
pub fn tau7(phase: Option<Phase>, q_E: f64) -> f64 {
    match phase {
        Some(Phase::Swing) if q_E < Q_E_SWING => 50.0,
        Some(Phase::Swing) => -30.0,
        Some(Phase::Touched) if q_E > 0.0 => 40.0,
        _ => 0.0,
    }
}

/// tau += Eqs. 16 to 21.
#[inline(never)]
pub fn add(law: &Feedforward, now: &Situation, tau: &mut [f64; NV]) {
    // tau_i acts on coordinate q_i, which stands at index i + 1.
    const FIRST: usize = ROOT - 2;
    let since = |t: f64| (PI * (now.t - t)).cos();
    let (clock, scale) = (&now.clock, law.scale);
    match clock.phase {
        Some(Phase::Swing) => {
            tau[FIRST + 5] += scale * (50.0 * since(clock.t0));
            tau[FIRST + 6] += scale * 20.0;
        }
        Some(Phase::Touched) => {
            let wave = scale * since(clock.t1);
            tau[FIRST + 2] -= 205.0 * wave;
            tau[FIRST + 3] -= 50.0 * wave;
            tau[FIRST + 5] += 100.0 * wave;
        }
        Some(Phase::PushOff) => {
            let wave = scale * since(clock.t2);
            tau[FIRST + 1] -= 100.0 * wave;
            tau[FIRST + 2] -= 75.0 * wave;
            tau[FIRST + 5] += scale * 30.0;
        }
        None => {}
    }
    tau[FIRST + 7] += clock.tau7;
}

/// Eq. 22 with t_e = t0.
#[inline(never)]
pub fn tau8(amplitude: f64, now: &Situation, tau: &mut f64) {
    *tau += now.clock.leg.sign() * amplitude * (PI * (now.t - now.clock.t0)).sin();
}
