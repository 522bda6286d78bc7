//! Lengths of steps, and times of controller samples between them.

use crate::{
    model::{
        contact_mode::{SoleContact, touches},
        controller_state::tick_rounding,
        layout::{LEG, ROOT},
        state::State,
    },
    sim::Simulation,
};

/// Minimum step [s]. Mean forces are impulses divided by the step, so a shorter one would amplify rounding.
pub(super) const MIN_STEP: f64 = 1e-8;
/// Fraction of the full length if the legs move quickly, or if both feet are on the ice in push-only contact.
const REDUCED: f64 = 0.5;
/// Fraction of the full length for the first step after a jump of the torques: a foot responds within a millisecond.
const AFTER_JUMP: f64 = 0.25;
/// The legs move quickly if a joint rotates by at least this angle in a full step [rad].
const QUICK_ROTATION: f64 = 0.035;
/// Coordinate of the supporting foot's angle.
const Q1: usize = ROOT - 1;
/// Maximum change of an angle in a step [rad]. Inertial forces, which grow with the square of the rates, make longer steps
/// unstable.
pub(super) const MAX_ROTATION: f64 = 0.3;
/// Angles may change by more in steps up to this length [s].
pub(super) const SHORTEST: f64 = 4.0 * MIN_STEP;

impl Simulation {
    /// Maximum length of a step from the present state; a full step has length `full` [s].
    pub(super) fn longest_step(&self, full: f64) -> f64 {
        let State { v, mode, .. } = &self.state;
        let calm = v[ROOT..LEG]
            .iter()
            .all(|rate| rate.abs() * full < QUICK_ROTATION);
        let (support, free) = touches(*mode);
        let may_chatter = self.model.contact.is_push_only
            && support != SoleContact::Air
            && free != SoleContact::Air;
        if calm && !may_chatter {
            return full;
        }
        let rates = v[Q1..self.model.n].iter();
        let fastest = rates.fold(0.0_f64, |most, rate| most.max(rate.abs()));
        (REDUCED * full).min((0.5 * MAX_ROTATION / fastest).max(MIN_STEP))
    }

    /// Length of the next step: `left` [s] is divided into the smallest number of equal steps, which may exceed the
    /// maximum by rounding. A full step has length `full` [s].
    pub(super) fn time_step(&self, left: f64, full: f64) -> f64 {
        let longest = self.longest_step(full);
        let rounding = tick_rounding(self.state.t) / longest + 1e-9;
        let h = left / (left / longest - rounding).ceil().max(1.0);
        if self.torque_jumped {
            h.min(AFTER_JUMP * full)
        } else {
            h
        }
    }

    /// Time to the next controller sample if a sample at the present state would change the controller state, else
    /// infinity [s].
    pub(super) fn time_to_noticed_sample(&self) -> f64 {
        if self.sampled() == self.state.controller {
            return f64::INFINITY;
        }
        let next = (self.sample_index() + 1) as f64 * self.model.scene.control.sample_period;
        (next - self.state.t).max(MIN_STEP)
    }

    /// Number of the last controller sample, counted from t = 0.
    pub(super) fn sample_index(&self) -> i64 {
        let t = self.state.t;
        ((t + tick_rounding(t)) / self.model.scene.control.sample_period) as i64
    }
}
