//! State of a simulation.

use crate::{
    error::{Invalid, MessageNumber},
    model::{
        Model,
        contact_mode::ContactMode,
        controller_state::ControllerState,
        layout::{LEG, NV},
    },
    numeric::trig::wrap_angle,
    scene::Leg,
};
use serde::{Deserialize, Serialize};
use std::f64::consts::FRAC_PI_2;

/// State between two steps. A copy of it continues the same motion, bit for bit.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct State {
    /// [s]
    pub t: f64,
    /// y0, z0 [m], q1 and the joints [rad]; see `notation`.
    pub q: [f64; NV],
    /// Velocities.
    pub v: [f64; NV],
    pub mode: ContactMode,
    pub support_leg: Leg,
    pub controller: ControllerState,
    /// World y of the free foot's contact point while it sticks [m].
    pub anchor: f64,
    pub energy_balance: EnergyBalance,
    /// Step size of the next attempt [s].
    pub h: f64,
    /// The motion is integrated by the method for stiff motions, until the contact mode changes.
    pub is_stiff: bool,
}

/// Energy balance since the start [J]. Kinetic plus potential energy changes by
/// actuators + kicks - damping - friction - impacts - capture.
#[derive(Debug, Clone, Copy, Default, PartialEq, Serialize, Deserialize)]
pub struct EnergyBalance {
    /// Kinetic and potential energy at the start.
    pub start: f64,
    /// Work of all torques on the robot, tau1's couple on the ice included.
    pub actuators: f64,
    /// Energy added by kicks; negative where they slow the robot down.
    pub kicks: f64,
    /// Dissipated by joint damping.
    pub damping: f64,
    /// Dissipated by sliding friction; negative where friction drives a pulled foot.
    pub friction: f64,
    /// Dissipated by inelastic impacts, including the correction of positions at a landing.
    pub impacts: f64,
    /// Dissipated where a slow foot is captured.
    pub capture: f64,
}

impl State {
    /// Angle of the free foot to the ice [rad].
    pub fn free_foot_angle(&self) -> f64 {
        self.q[3..LEG].iter().fold(self.q[2], |sum, q| sum + q)
    }

    /// Distances from heel to toe of both feet along y where they are flat; see `ContactProblem::lever` [m].
    pub fn levers(&self, model: &Model) -> [f64; 2] {
        [self.q[2], self.free_foot_angle()].map(|angle| {
            let is_upright = wrap_angle(angle).abs() < FRAC_PI_2;
            model.sole.length() * if is_upright { 1.0 } else { -1.0 }
        })
    }

    /// All numbers, in any units.
    pub(crate) fn numbers(&self) -> impl Iterator<Item = f64> {
        let Self {
            t,
            q,
            v,
            mode: _,
            support_leg: _,
            controller,
            anchor,
            energy_balance,
            h,
            is_stiff: _,
        } = self;
        let EnergyBalance {
            start,
            actuators,
            kicks,
            damping,
            friction,
            impacts,
            capture,
        } = energy_balance;
        let work = [start, actuators, kicks, damping, friction, impacts, capture];
        let numbers = q.iter().chain(v).chain([t, anchor, h]).chain(work);
        numbers.copied().chain(controller.numbers())
    }
}

impl EnergyBalance {
    /// Kinetic and potential energy expected from the balance [J].
    pub fn total(&self) -> f64 {
        let brought = self.start + self.actuators + self.kicks;
        brought - self.damping - self.friction - self.impacts - self.capture
    }
}

/// Bound of the velocities [m/s, rad/s]. Forces and energies grow with the square of a velocity and soon overflow
/// beyond it.
pub const FASTEST: f64 = 1e9;

/// Are all velocities within `FASTEST`?
pub fn is_bounded(v: &[f64]) -> bool {
    v.iter()
        .fold(true, |so_far, v| so_far & (v.abs() <= FASTEST))
}

/// Check a state given by a user.
pub fn check_finite(name: &str, values: &[f64]) -> Result<(), Invalid> {
    for (i, x) in values.iter().enumerate() {
        if !x.is_finite() || x.abs() > 1e6 {
            return Err(Invalid(format!(
                "{name}[{i}] = {}: must lie in [-1e6, 1e6]",
                MessageNumber(*x)
            )));
        }
    }
    Ok(())
}
