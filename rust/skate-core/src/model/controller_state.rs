//! What the controller remembers between its samples.

use crate::{
    model::contact_mode::{ContactMode, SoleContact},
    scene::Leg,
};
use serde::{Deserialize, Serialize};

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

/// Instants that the feedforward counts from, and what it samples with its own period: which law
/// applies, and the switch of Eq. 21. In continuous time both can chatter without end, because a law
/// may push the robot back into the state whose law pushes it out again.
#[derive(Debug, Clone, Copy, Default, PartialEq, Serialize, Deserialize)]
pub struct ControllerState {
    /// Swap of the legs [s].
    pub t0: f64,
    /// The free foot touched: state 3 -> 7 [s].
    pub t1: f64,
    /// The supporting foot began to rotate: state 7 -> 15/16 [s].
    pub t2: f64,
    /// The law in force, as last sampled.
    pub phase: Option<Phase>,
    /// The leg it takes for the supporting one. On ice that only pushes, two feet can take turns a
    /// million times a second.
    pub leg: Leg,
    /// A foot was on the ice at the last sample; in flight there is no supporting ankle to lift the
    /// head from.
    pub supported: bool,
    /// tau7 of Eq. 21 as last sampled [N m].
    pub tau7: f64,
}

/// Ticks of the controller's clock are this exact [s]: rounding of t after an hour.
pub const TICK_ROUNDING: f64 = 1e-12;
