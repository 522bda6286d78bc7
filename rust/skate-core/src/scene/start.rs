//! The state at t = 0.

use crate::scene::declaration::{Name, Numbers, Range, Visit};
use serde::{Deserialize, Serialize};
use std::{collections::BTreeMap, str::Split};

/// Names of all coordinates, in the order of `q` and `v` (Eq. 9, with z0 for a robot that may leave
/// the ice).
pub const COORDINATES: [&str; 19] = [
    "y0", "z0", "q1", "q2", "q3", "q4", "q5", "q6", "q7", "q8", "q9", "q10", "q11", "q12", "q13",
    "q14", "q15", "q16", "q17",
];

/// The state at t = 0. Coordinates that are not named are zero; y0 and z0 are those of the supporting foot's toe.
#[derive(Debug, Clone, Default, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Start {
    pub support_leg: Leg,
    /// Coordinates by name. Unit: m for y0 and z0, rad for the others, range: -1e6 to 1e6.
    pub q: BTreeMap<String, f64>,
    /// Velocities by name. Unit: m/s for y0 and z0, rad/s for the others, range: -1e6 to 1e6.
    pub v: BTreeMap<String, f64>,
}

/// One of the robot's legs.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Leg {
    #[default]
    Right,
    Left,
}

impl Leg {
    pub fn other(self) -> Self {
        match self {
            Self::Right => Self::Left,
            Self::Left => Self::Right,
        }
    }

    pub fn name(self) -> &'static str {
        match self {
            Self::Right => "right",
            Self::Left => "left",
        }
    }

    /// +1 on the right (positive x), -1 on the left.
    pub fn sign(self) -> f64 {
        match self {
            Self::Right => 1.0,
            Self::Left => -1.0,
        }
    }
}

impl Numbers for Start {
    /// Names are checked in `rules`; here any name has a range.
    fn range(parts: &mut Split<'_, char>) -> Option<Range> {
        let table = parts.next()?;
        let is_length = ["y0", "z0"].contains(&parts.next()?);
        let unit = match (table, is_length) {
            ("q", true) => "m",
            ("q", false) => "rad",
            ("v", true) => "m/s",
            ("v", false) => "rad/s",
            _ => return None,
        };
        let (low, high) = (-1e6, 1e6);
        parts.next().is_none().then_some(Range { low, high, unit })
    }

    fn each<'a>(&'a mut self, name: Option<&Name<'_>>, visit: Visit<'_, 'a>) {
        for (table, values) in [("q", &mut self.q), ("v", &mut self.v)] {
            let table = Name::new(name, table);
            for (coordinate, x) in values {
                visit(Name::new(Some(&table), coordinate), x);
            }
        }
    }
}
