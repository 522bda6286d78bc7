//! Limit on the cost of a motion. A simulation that needs many times the usual number of evaluations per
//! simulated time terminates with `step_limit` or `overspeed`, so that one robot of a batch does not stall the others.

use crate::{
    integrate::Method,
    numeric::elementary,
    scene::{Accuracy, Way},
};
use serde::{Deserialize, Serialize};

/// Evaluations per simulated second at `balanced`: the median of randomly drawn scenes [1/s].
const USUAL_RATE: f64 = 9200.0;
/// Evaluations per time step: of time-stepping, and of other fixed-step methods. Both exceed the method's
/// own number to allow for events and halved steps.
const PER_STEP: [f64; 2] = [2.5, 6.0];
/// Sustained cost limit, as a multiple of the usual cost.
const SUSTAINED: f64 = 25.0;
/// Burst limit, as a duration at the usual cost [s]. Over 10 ms both limits together allow 40 times the
/// usual cost; the step that exceeds the limit adds a few hundred evaluations.
const BURST: f64 = 0.15;
/// Evaluations that every call adds to the allowance, so that tiny steps are possible.
const CALL_ALLOWANCE: f64 = 20.0;

/// Leaky bucket: evaluations fill it, simulated time drains it.
#[derive(Debug, Clone, Copy, Default, PartialEq, Serialize, Deserialize)]
pub struct Budget {
    debt: f64,
    /// Evaluations counted up to the time `t`.
    evaluations: u64,
    t: f64,
}

impl Budget {
    /// Add the allowance of one call.
    pub fn add_call(&mut self) {
        self.debt = (self.debt - CALL_ALLOWANCE).max(0.0);
    }

    /// Count all evaluations up to the time `t`. Returns whether they are within the limit.
    pub fn charge(&mut self, accuracy: Accuracy, t: f64, evaluations: u64) -> bool {
        let usual_rate = usual_rate(accuracy);
        let allowed = SUSTAINED * usual_rate * (t - self.t).max(0.0);
        let spent = evaluations.saturating_sub(self.evaluations);
        self.debt = (self.debt - allowed).max(0.0) + spent as f64;
        (self.t, self.evaluations) = (t, evaluations);
        self.debt <= BURST * usual_rate
    }
}

/// Usual number of evaluations of one `advance` by `time` [s].
pub fn usual_evaluations(accuracy: Accuracy, time: f64) -> f64 {
    usual_rate(accuracy) * time
}

/// Upper bound on the evaluations of one `advance` by `time` [s], excluding the last step, which may exceed
/// it.
pub fn most_evaluations(accuracy: Accuracy, time: f64) -> f64 {
    (BURST + SUSTAINED * time) * usual_rate(accuracy) + CALL_ALLOWANCE
}

/// Usual number of evaluations per simulated second [1/s]. It has a lower bound for loose tolerances, set
/// by events and the stability of explicit methods.
fn usual_rate(accuracy: Accuracy) -> f64 {
    let method = match accuracy.way() {
        Way::TimeSteps { step } => return PER_STEP[0] / step,
        Way::Events(method) => method,
    };
    if let Some(step) = method.step() {
        return USUAL_RATE + PER_STEP[1] / step;
    }
    // Measured growth in random scenes: of `dop853` between 5e-6 and 1e-11 3.3 times, of `dopri5` between 1e-6 and 1e-11
    // 6.5 times, of `rosenbrock` between 1e-5 and 1e-7 4 times.
    let (tolerance, order) = match method {
        Method::Rosenbrock(_) => (1e-5, 3.0),
        Method::Dop853(_) => (5e-6, 12.0),
        Method::Dopri5(_) | Method::Rk4(_) => (1e-6, 6.0),
    };
    let refinement = method
        .tolerance()
        .map_or(1.0, |requested| tolerance / requested);
    USUAL_RATE * elementary::pow(refinement.max(1.0), 1.0 / order)
}
