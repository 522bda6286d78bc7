//! Everything that changes while the robot moves.

use crate::{
    error::{Invalid, Shown},
    model::{
        contact_mode::ContactMode,
        controller_state::ControllerState,
        layout::{LEG, NV},
    },
    scene::Leg,
};
use serde::{Deserialize, Serialize};

/// The state between two steps; continuing from a copy of it is exact.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct State {
    /// [s]
    pub t: f64,
    /// y0, z0 [m], q1 and the joints [rad]; see `notation`.
    pub q: [f64; NV],
    /// Their rates.
    pub v: [f64; NV],
    pub mode: ContactMode,
    pub support_leg: Leg,
    pub controller: ControllerState,
    /// Where the free foot's contact point sticks, world y [m]; read only while it sticks.
    pub anchor: f64,
    pub energy_balance: EnergyBalance,
    /// Step size to try next [s].
    pub h: f64,
}

/// Energy balance since the start [J]. Kinetic plus potential energy changes by
/// actuators + kicks - damping - friction - impacts - capture.
#[derive(Debug, Clone, Copy, Default, PartialEq, Serialize, Deserialize)]
pub struct EnergyBalance {
    /// Kinetic and potential energy at the start.
    pub start: f64,
    /// Work of all torques on the robot, tau1's couple on the ice included.
    pub actuators: f64,
    /// Brought in by kicks; negative where they slow the robot down.
    pub kicks: f64,
    /// Taken by viscous joints.
    pub damping: f64,
    /// Taken by sliding friction (negative where a pulled foot is thrust).
    pub friction: f64,
    /// Taken by inelastic impacts, which put what lands exactly on the ice.
    pub impacts: f64,
    /// Taken where a slow foot is made to stick.
    pub capture: f64,
}

impl State {
    /// Angle of the free foot to the ice [rad].
    pub fn free_foot_angle(&self) -> f64 {
        self.q[3..LEG].iter().fold(self.q[2], |sum, q| sum + q)
    }
}

impl EnergyBalance {
    /// Kinetic and potential energy that should be there now [J].
    pub fn total(&self) -> f64 {
        let brought = self.start + self.actuators + self.kicks;
        brought - self.damping - self.friction - self.impacts - self.capture
    }
}

/// No motion of a robot is as fast [m/s, rad/s]; before long the squares of such speeds, which forces and
/// energies grow with, are no numbers.
pub const FASTEST: f64 = 1e9;

/// Is a motion one that the arithmetic can hold?
pub fn is_bounded(v: &[f64]) -> bool {
    v.iter()
        .fold(true, |so_far, v| so_far & (v.abs() <= FASTEST))
}

/// Check a state given by a person.
pub fn check_finite(name: &str, values: &[f64]) -> Result<(), Invalid> {
    for (i, x) in values.iter().enumerate() {
        if !x.is_finite() || x.abs() > 1e6 {
            return Err(Invalid(format!(
                "{name}[{i}] = {}: must lie in [-1e6, 1e6]",
                Shown(*x)
            )));
        }
    }
    Ok(())
}
