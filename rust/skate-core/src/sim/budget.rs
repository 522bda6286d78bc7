//! What a motion may cost: a simulation that needs many times the usual number of evaluations for its
//! progress ends with `step_limit`, so that one robot of many never keeps the others waiting.

use crate::{
    error::Termination,
    integrate::Method,
    scene::{Accuracy, Way},
};
use serde::{Deserialize, Serialize};

/// Evaluations that a second takes at `balanced`: the median of scenes drawn at random [1/s].
const USUAL: f64 = 9200.0;
/// The same for a fixed step: some more than the method's own, for events; those of time-stepping are halved, too.
const PER_STEP: [f64; 2] = [2.5, 6.0];
/// A motion may go on at so many times the usual cost,
const SUSTAINED: f64 = 25.0;
/// and spend at once what so much time usually takes [s]. In 10 ms both together come to 40 times the
/// usual; the step that goes beyond adds a few hundred evaluations.
const BURST: f64 = 0.15;
/// Evaluations that every call may add: whoever asks for tiny steps shall have them.
const CALL: f64 = 20.0;

/// An account that evaluations fill and progress empties.
#[derive(Debug, Clone, Copy, Default, PartialEq, Serialize, Deserialize)]
pub struct Budget {
    debt: f64,
    /// What has been counted: evaluations up to the time t.
    evaluations: u64,
    t: f64,
}

impl Budget {
    /// Somebody asks for a step.
    pub fn add_call(&mut self) {
        self.debt = (self.debt - CALL).max(0.0);
    }

    /// Count all evaluations up to the time `t`.
    ///
    /// # Errors
    /// `StepLimit` where they are too many.
    pub fn charge(
        &mut self,
        accuracy: Accuracy,
        t: f64,
        evaluations: u64,
    ) -> Result<(), Termination> {
        let usual = usual(accuracy);
        let earned = SUSTAINED * usual * (t - self.t).max(0.0);
        let spent = evaluations.saturating_sub(self.evaluations);
        self.debt = (self.debt - earned).max(0.0) + spent as f64;
        (self.t, self.evaluations) = (t, evaluations);
        if self.debt > BURST * usual {
            return Err(Termination::StepLimit);
        }
        Ok(())
    }
}

/// Most evaluations that one call of `advance` by `time` [s] costs, but for the last step, which may go
/// beyond.
pub fn most_evaluations(accuracy: Accuracy, time: f64) -> f64 {
    (BURST + SUSTAINED * time) * usual(accuracy) + CALL
}

/// Evaluations that a second usually takes [1/s]. Events and the stability of explicit methods do not come
/// cheaper with a loose tolerance.
fn usual(accuracy: Accuracy) -> f64 {
    let method = match accuracy.way() {
        Way::TimeSteps { step } => return PER_STEP[0] / step,
        Way::Events(method) => method,
    };
    if let Some(step) = method.step() {
        return USUAL + PER_STEP[1] / step;
    }
    // Measured between 1e-6 and 1e-11: 6.5 times; between 1e-5 and 1e-7: 4 times.
    let (tolerance, order) = match method {
        Method::Rosenbrock(_) => (1e-5, 3.0),
        Method::Dopri5(_) | Method::Rk4(_) => (1e-6, 6.0),
    };
    let finer = method.tolerance().map_or(1.0, |own| tolerance / own);
    USUAL * finer.max(1.0).powf(1.0 / order)
}
