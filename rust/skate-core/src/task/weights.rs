//! Weights and limits of the reward.

use crate::error::Invalid;
use std::collections::BTreeMap;

/// Names of the reward terms, in order.
pub const TERMS: [&str; 5] = ["slide", "head", "flight", "speed", "fall"];

/// Weights of the terms, and limits.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Weights {
    /// Weight per unit of each term, in the order of `TERMS`.
    pub terms: [f64; TERMS.len()],
    /// Speed of the hips beyond which the term `speed` counts [m/s].
    pub high_speed: f64,
    /// An episode without a gait step for this time terminates [s].
    pub longest_step: f64,
}

/// Names, units and default values of all weights, the terms first, then the limits.
pub const WEIGHTS: [(&str, &str, f64); TERMS.len() + 2] = [
    ("slide", "1/m", 1.0),
    ("head", "1/s", 0.2),
    ("flight", "1/s", 0.5),
    ("speed", "1/m", 2.0),
    ("fall", "1", 1.0),
    ("high_speed", "m/s", 5.0),
    ("longest_step", "s", 2.0),
];

impl Default for Weights {
    fn default() -> Self {
        Self::from_array(WEIGHTS.map(|(_, _, value)| value))
    }
}

impl Weights {
    fn from_array(values: [f64; WEIGHTS.len()]) -> Self {
        let [high_speed, longest_step] = *values.last_chunk().expect("two limits");
        Self {
            terms: *values.first_chunk().expect("five terms"),
            high_speed,
            longest_step,
        }
    }

    /// The default weights with some values replaced, by name.
    ///
    /// # Errors
    /// `Invalid` if a name is unknown or a value out of range.
    pub fn with(given: &BTreeMap<String, f64>) -> Result<Self, Invalid> {
        let mut values = WEIGHTS.map(|(_, _, value)| value);
        for (name, &x) in given {
            let Some(i) = WEIGHTS.iter().position(|(known, _, _)| known == name) else {
                let known = WEIGHTS.map(|(name, _, _)| name).join(", ");
                return Err(Invalid(format!("reward: {name:?}: must be one of {known}")));
            };
            let (_, unit, _) = WEIGHTS[i];
            let low = if i < TERMS.len() { -1e6 } else { 0.0 };
            Invalid::range(&format!("reward[{name}]"), x, low, 1e6, unit)?;
            values[i] = x;
        }
        Ok(Self::from_array(values))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn unknown_weights_are_refused() {
        let given = |name: &str, x| Weights::with(&BTreeMap::from([(name.to_string(), x)]));
        assert_eq!(given("slide", 1.0), Ok(Weights::default()));
        assert!(
            given("posture", 1.0)
                .expect_err("unknown")
                .0
                .contains("must be one of slide, head")
        );
        assert!(given("high_speed", -1.0).is_err() && given("head", f64::NAN).is_err());
    }
}
