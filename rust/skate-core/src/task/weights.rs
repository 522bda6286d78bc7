//! Weights and limits of the reward.

use crate::error::Invalid;
use std::collections::BTreeMap;

/// Names of the reward terms, in order.
pub const TERMS: [&str; 8] = [
    "slide", "step", "head", "flight", "speed", "trunk", "effort", "fall",
];

/// Weights of the terms, and limits of what is rewarded.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Weights {
    /// Weight per unit of each term, in the order of `TERMS`.
    pub terms: [f64; TERMS.len()],
    /// Largest rewarded speed [m/s].
    pub fastest: f64,
    /// Shortest gait step with the full reward, and longest gait step with a reward [s].
    pub shortest_step: f64,
    pub longest_step: f64,
    /// Largest rewarded slide of a gait step [m].
    pub long_slide: f64,
    /// Speed of the hips beyond which the term `speed` counts [m/s].
    pub high_speed: f64,
}

/// Names, units and default values of all weights, the terms first, then the limits.
pub const WEIGHTS: [(&str, &str, f64); TERMS.len() + 5] = [
    ("slide", "1/m", 4.0),
    ("step", "1/m", 10.0),
    ("head", "1/s", 2.0),
    ("flight", "1/s", 9.0),
    ("speed", "1/m", 0.0),
    ("trunk", "1/(s rad2)", 1.0),
    ("effort", "1/s", 0.1),
    ("fall", "1", 5.0),
    ("fastest", "m/s", 1.5),
    ("shortest_step", "s", 0.38),
    ("longest_step", "s", 1.25),
    ("long_slide", "m", 0.6),
    ("high_speed", "m/s", 2.5),
];

impl Default for Weights {
    fn default() -> Self {
        Self::from_array(WEIGHTS.map(|(_, _, value)| value))
    }
}

impl Weights {
    fn from_array(values: [f64; WEIGHTS.len()]) -> Self {
        let limits = *values.last_chunk().expect("five limits");
        let [fastest, shortest_step, longest_step, long_slide, high_speed] = limits;
        Self {
            terms: *values.first_chunk().expect("eight terms"),
            fastest,
            shortest_step,
            longest_step,
            long_slide,
            high_speed,
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
        assert_eq!(given("slide", 4.0), Ok(Weights::default()));
        assert!(
            given("posture", 1.0)
                .expect_err("unknown")
                .0
                .contains("must be one of slide, step")
        );
        assert!(given("fastest", -1.0).is_err() && given("head", f64::NAN).is_err());
    }
}
