//! Errors: invalid scenes, states and arguments, and the reasons why a simulation ends.

use serde::{Deserialize, Serialize};
use std::fmt;
use thiserror::Error;

/// A scene, state or argument that cannot be used. The message names the value and the valid range.
#[derive(Debug, Clone, PartialEq, Error)]
#[error("{0}")]
pub struct Invalid(pub String);

impl Invalid {
    /// Check `low <= x <= high`; `name` is the dotted name of the field, `unit` its SI unit, "1" for none.
    pub fn range(name: &str, x: f64, low: f64, high: f64, unit: &str) -> Result<(), Self> {
        if (low..=high).contains(&x) {
            return Ok(());
        }
        let unit = if unit == "1" {
            String::new()
        } else {
            format!(" {unit}")
        };
        Err(Self(format!(
            "{name} = {}: must lie in [{}, {}]{unit}",
            MessageNumber(x),
            MessageNumber(low),
            MessageNumber(high)
        )))
    }
}

/// A number in a message; very small and very large ones are printed with an exponent.
#[derive(Debug, Clone, Copy)]
pub struct MessageNumber(pub f64);

impl fmt::Display for MessageNumber {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let size = self.0.abs();
        if size == 0.0 || (1e-6..1e16).contains(&size) {
            write!(f, "{}", self.0)
        } else {
            write!(f, "{:e}", self.0)
        }
    }
}

/// Why a simulation ended.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
pub enum Termination {
    /// The head is too low, or a knee or an ankle has reached the ice.
    Fall,
    /// No contact mode is consistent with the laws of contact and friction (Painleve).
    Jam,
    /// The contact equations have no unique solution.
    Singular,
    /// The time steps are too small, or the motion needs many times the usual number of evaluations.
    StepLimit,
    /// The same, while a joint or the supporting foot turns faster than 1,000 rad/s.
    Overspeed,
    /// A number is outside the bounds within which the arithmetic stays finite.
    NotFinite,
    /// The normal force of a foot that may be pulled grows without bound in finite time.
    Wedged,
    /// The task's robot has made no gait step for too long.
    NoStep,
}

impl Termination {
    /// In the order of their indices.
    pub const ALL: [Self; 8] = [
        Self::Fall,
        Self::Jam,
        Self::Singular,
        Self::StepLimit,
        Self::Overspeed,
        Self::NotFinite,
        Self::Wedged,
        Self::NoStep,
    ];

    /// The name in Python, JSON and tables.
    pub fn name(self) -> &'static str {
        match self {
            Self::Fall => "fall",
            Self::Jam => "jam",
            Self::Singular => "singular",
            Self::StepLimit => "step_limit",
            Self::Overspeed => "overspeed",
            Self::NotFinite => "not_finite",
            Self::Wedged => "wedged",
            Self::NoStep => "no_step",
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Python maps indices to names.
    #[test]
    fn all_is_in_the_order_of_indices() {
        for (i, cause) in Termination::ALL.into_iter().enumerate() {
            assert_eq!(cause as usize, i);
        }
    }
}
