//! State of the controller.

use crate::{
    model::contact_mode::{ContactMode, SoleContact},
    scene::Leg,
};
use serde::{Deserialize, Serialize};

/// Phase of the feedforward torques. The paper prints them for states 3, 7, 14 and 16. Other states use those of
/// the state that differs only by sticking or by the rotation of the supporting foot.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
pub enum Phase {
    /// States 1 to 4, printed for 3: the free foot is in the air.
    Swing,
    /// States 5 to 12, printed for 7: the free foot is in point contact.
    Touched,
    /// States 14, 16, 18, 20, printed for 14 and 16: the free foot is flat and the supporting foot rotates.
    PushOff,
}

impl Phase {
    /// `None` for states 13, 15, 17, 19 and in flight.
    pub fn of(mode: ContactMode) -> Option<Self> {
        match (mode.support.touch, mode.free.touch) {
            (SoleContact::Air, _) => None,
            (_, SoleContact::Air) => Some(Self::Swing),
            (_, SoleContact::Heel | SoleContact::Toe) => Some(Self::Touched),
            (SoleContact::Flat, SoleContact::Flat) => None,
            (_, SoleContact::Flat) => Some(Self::PushOff),
        }
    }
}

/// Times from which the feedforward counts, and the quantities sampled with the controller's period: the phase and
/// the switch of Eq. 21. In continuous time both can chatter: the torques of each of two states may drive the robot
/// into the other.
#[derive(Debug, Clone, Copy, Default, PartialEq, Serialize, Deserialize)]
pub struct ControllerState {
    /// Swap of the legs [s].
    pub t0: f64,
    /// The free foot touched: state 3 -> 7 [s].
    pub t1: f64,
    /// The supporting foot began to rotate: state 7 -> 15/16 [s].
    pub t2: f64,
    /// Phase at the last sample.
    pub phase: Option<Phase>,
    /// Supporting leg at the last sample. In push-only contact the feet can swap a million times a second.
    pub leg: Leg,
    /// Whether a foot was on the ice at the last sample. In flight there is no supporting ankle from which to lift
    /// the head.
    pub supported: bool,
    /// tau7 of Eq. 21 as last sampled [N m].
    pub tau7: f64,
}

impl ControllerState {
    /// All numbers [s, N m].
    pub(crate) fn numbers(&self) -> [f64; 4] {
        [self.t0, self.t1, self.t2, self.tau7]
    }
}

/// Rounding of the time in the first minutes [s], and later relative to the time, which some steps between two samples
/// have been added to.
const TICK_ROUNDING: f64 = 1e-12;
const RELATIVE_ROUNDING: f64 = 8.0 * f64::EPSILON;

/// Tolerance of the sample times near the time `t` [s].
pub fn tick_rounding(t: f64) -> f64 {
    TICK_ROUNDING.max(RELATIVE_ROUNDING * t)
}
