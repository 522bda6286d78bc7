//! Limit on the cost of a motion. A simulation that needs many times the usual number of evaluations per
//! simulated time terminates with `step_limit` or `overspeed`, so that one robot of a batch does not stall the others.

use serde::{Deserialize, Serialize};

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
    /// All numbers that are no counts.
    pub fn numbers(&self) -> [f64; 2] {
        [self.debt, self.t]
    }

    /// Add the allowance of one call.
    pub fn add_call(&mut self) {
        self.debt = (self.debt - CALL_ALLOWANCE).max(0.0);
    }

    /// Count all evaluations up to the time `t`. Returns whether they are within the limit. `usual_rate` is that of the
    /// model.
    pub fn charge(&mut self, usual_rate: f64, t: f64, evaluations: u64) -> bool {
        let allowed = SUSTAINED * usual_rate * (t - self.t).max(0.0);
        let spent = evaluations.saturating_sub(self.evaluations);
        self.debt = (self.debt - allowed).max(0.0) + spent as f64;
        (self.t, self.evaluations) = (t, evaluations);
        self.debt <= BURST * usual_rate
    }
}

/// Upper bound on the evaluations of one `advance` by `time` [s], excluding the last step, which may exceed
/// it. `usual_rate` is that of the model.
pub fn most_evaluations(usual_rate: f64, time: f64) -> f64 {
    (BURST + SUSTAINED * time) * usual_rate + CALL_ALLOWANCE
}
