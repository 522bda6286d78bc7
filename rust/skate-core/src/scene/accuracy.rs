//! How exactly the motion is integrated.

use crate::{
    integrate::{Control, ErrorControl, Fixed, Method},
    scene::declaration::{Name, Numbers, Range, Visit},
};
use serde::{Deserialize, Serialize};
use std::str::Split;

/// Relative tolerance of a method with error control.
const TOLERANCE: Range = Range {
    low: 1e-13,
    high: 1e-2,
    unit: "relative",
};
/// Length of fixed steps.
const STEP: Range = Range {
    low: 1e-6,
    high: 0.1,
    unit: "s",
};

/// How exactly the motion is integrated.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[serde(
    untagged,
    expecting = "must be fast, balanced, reference, a tolerance, or a table: method dop853, dopri5 or rosenbrock with a tolerance or a step, rk4 or moreau with a step"
)]
pub enum Accuracy {
    Named(AccuracyName),
    /// Relative tolerance of Dormand-Prince of order 8 with error control, and of a linearly implicit method where the
    /// motion is stiff; range: 1e-13 to 1e-2.
    Tolerance(f64),
    /// A chosen integrator; its tolerance has the range above, its step 1e-6 to 0.1 s.
    Method(Method),
    TimeStepping(TimeStepping),
}

/// Time-stepping for training: contacts act by impulses, steps have two fixed lengths.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[serde(tag = "method", rename_all = "snake_case", deny_unknown_fields)]
pub enum TimeStepping {
    /// After Moreau (1988). `step` is the longer of the two lengths, the other is half of it. Unit: s,
    /// range: 1e-6 to 0.1.
    Moreau { step: f64 },
}

/// The accuracies that have a name.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum AccuracyName {
    Fast,
    Balanced,
    Reference,
}

impl Numbers for Accuracy {
    fn range(parts: &mut Split<'_, char>) -> Option<Range> {
        let range = match parts.next() {
            None => return Some(TOLERANCE),
            Some("tolerance") => TOLERANCE,
            Some("step") => STEP,
            Some(_) => return None,
        };
        parts.next().is_none().then_some(range)
    }

    fn each<'a>(&'a mut self, name: Option<&Name<'_>>, visit: Visit<'_, 'a>) {
        match self {
            Self::Named(_) => {}
            Self::Tolerance(x) => {
                if let Some(&name) = name {
                    visit(name, x);
                }
            }
            Self::TimeStepping(TimeStepping::Moreau { step })
            | Self::Method(
                Method::Dop853(Control::Fixed(Fixed { step }))
                | Method::Dopri5(Control::Fixed(Fixed { step }))
                | Method::Rosenbrock(Control::Fixed(Fixed { step }))
                | Method::Rk4(Fixed { step }),
            ) => visit(Name::new(name, "step"), step),
            Self::Method(
                Method::Dop853(Control::Error(ErrorControl { tolerance }))
                | Method::Dopri5(Control::Error(ErrorControl { tolerance }))
                | Method::Rosenbrock(Control::Error(ErrorControl { tolerance })),
            ) => visit(Name::new(name, "tolerance"), tolerance),
        }
    }
}
