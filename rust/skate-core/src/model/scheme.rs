//! The numerical scheme of a model, compiled from the accuracy of its scene.

use crate::{
    integrate::{Fixed, Method},
    numeric::elementary,
    scene::{Accuracy, AccuracyName, TimeStepping},
};

/// Step of `fast` [s], relative tolerances of `balanced`, also for its stiff motions, and of `reference`;
/// `docs/accuracy.md` says why.
const FAST: f64 = 0.005;
const BALANCED: f64 = 1e-3;
const BALANCED_STIFF: f64 = 1e-4;
const REFERENCE: f64 = 1e-11;
/// Tolerance for stiff motions, as a multiple of that for others. A method of order 3 needs a smaller one for the same
/// error of the motion.
const STIFF: f64 = 0.01;

/// Evaluations per simulated second at a tolerance of 5e-6: the median of randomly drawn scenes [1/s].
const USUAL_RATE: f64 = 9200.0;
/// Lower bound for loose tolerances, as a fraction of that: events and the stability of explicit methods set it.
const LEAST_RATE: f64 = 0.64;
/// Evaluations per time step: of time stepping, and of other fixed steps. Both exceed the method's own number to allow
/// for events and halved steps.
const PER_TIME_STEP: f64 = 2.5;
const PER_FIXED_STEP: f64 = 6.0;

/// The two kinds of schemes for motions with contacts (Acary and Brogliato 2008).
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Scheme {
    /// Smooth motions between located events.
    EventDriven(Methods),
    /// Contacts act by impulses in steps of given lengths; the longer one [s].
    TimeStepping { step: f64 },
}

/// Methods for smooth motions.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Methods {
    pub usual: Method,
    /// For motions that are stiff for `usual`; None if that integrates all motions.
    pub stiff: Option<Method>,
}

impl Methods {
    /// One method for all motions.
    const fn one(usual: Method) -> Self {
        Self { usual, stiff: None }
    }

    /// An explicit method with error control, and a linearly implicit one for stiff motions.
    const fn controlled(tolerance: f64, stiff: f64) -> Self {
        Self {
            usual: Method::dop853(tolerance),
            stiff: Some(Method::rosenbrock(stiff)),
        }
    }

    /// The method of a motion that is stiff or not.
    pub fn of(self, is_stiff: bool) -> Method {
        let stiff = self.stiff.filter(|_| is_stiff);
        stiff.unwrap_or(self.usual)
    }
}

impl From<Accuracy> for Scheme {
    fn from(accuracy: Accuracy) -> Self {
        match accuracy {
            Accuracy::Named(AccuracyName::Fast) => Self::TimeStepping { step: FAST },
            Accuracy::Named(AccuracyName::Balanced) => {
                Self::EventDriven(Methods::controlled(BALANCED, BALANCED_STIFF))
            }
            Accuracy::Named(AccuracyName::Reference) => {
                Self::EventDriven(Methods::controlled(REFERENCE, STIFF * REFERENCE))
            }
            Accuracy::Tolerance(tolerance) => {
                Self::EventDriven(Methods::controlled(tolerance, STIFF * tolerance))
            }
            Accuracy::Method(method) => Self::EventDriven(Methods::one(method)),
            Accuracy::TimeStepping(TimeStepping::Moreau { step }) => Self::TimeStepping { step },
        }
    }
}

impl Scheme {
    /// Are events located? Then they are handled at once, otherwise in the next step.
    pub fn locates_events(self) -> bool {
        matches!(self, Self::EventDriven(_))
    }

    /// Methods for the smooth parts of a motion. For time stepping, which has no such parts, an explicit method with
    /// the same steps.
    pub fn methods(self) -> Methods {
        match self {
            Self::EventDriven(methods) => methods,
            Self::TimeStepping { step } => Methods::one(Method::Rk4(Fixed { step })),
        }
    }

    /// Length of a full step [s]; infinite if the error control chooses the length.
    pub fn full_step(self) -> f64 {
        self.methods().usual.step().unwrap_or(f64::INFINITY)
    }

    /// Usual number of evaluations per simulated second [1/s].
    pub fn usual_rate(self) -> f64 {
        let method = match self {
            Self::TimeStepping { step } => return PER_TIME_STEP / step,
            Self::EventDriven(methods) => methods.usual,
        };
        if let Some(step) = method.step() {
            return USUAL_RATE + PER_FIXED_STEP / step;
        }
        // Measured growth in random scenes: of `dop853` between 1e-3 and 5e-6 1.5 times, from there to 1e-11 3.3 times, of
        // `dopri5` between 1e-6 and 1e-11 6.5 times, of `rosenbrock` between 1e-5 and 1e-7 4 times.
        let (tolerance, order) = match method {
            Method::Rosenbrock(_) => (1e-5, 3.0),
            Method::Dop853(_) => (5e-6, 12.0),
            Method::Dopri5(_) | Method::Rk4(_) => (1e-6, 6.0),
        };
        let refinement = method
            .tolerance()
            .map_or(1.0, |requested| tolerance / requested);
        USUAL_RATE * elementary::pow(refinement, 1.0 / order).max(LEAST_RATE)
    }
}
