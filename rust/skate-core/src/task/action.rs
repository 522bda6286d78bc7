//! Mapping from actions to residual torques.

use crate::{
    model::layout::{NV, ROOT},
    sim::Simulation,
    task::Task,
};

/// Residual torques of an action [N m] and its mean square.
pub(super) fn residual(task: &Task, sim: &Simulation, action: &[f64]) -> ([f64; NV], f64) {
    // The baseline is needed only for a finite limit.
    let baseline = task.torque_limit.is_finite().then(|| sim.baseline());
    let mut residual = [0.0; NV];
    let mut effort = 0.0;
    for (i, &a) in action.iter().enumerate() {
        let a = a.clamp(-1.0, 1.0);
        effort += a * a / task.joints() as f64;
        let torque = task.scale[i] * a;
        residual[i] = match &baseline {
            Some(baseline) => limit_torque(torque, baseline[ROOT + i], task.torque_limit),
            None => torque,
        };
    }
    (residual, effort)
}

/// Limit a residual torque so that its sum with the baseline's torque stays within the limit, or within the
/// baseline's own magnitude.
fn limit_torque(residual: f64, baseline: f64, limit: f64) -> f64 {
    let limit = limit.max(baseline.abs());
    if (baseline + residual).abs() <= limit {
        residual
    } else {
        residual.signum() * limit - baseline
    }
}
