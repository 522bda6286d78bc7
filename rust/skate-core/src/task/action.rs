//! Mapping from actions to residual torques.

use crate::{
    model::layout::{NV, ROOT},
    scene::Leg,
    sim::Simulation,
    task::Task,
};

/// Residual torques of an action [N m]. `leg` supported when the action was chosen.
pub(super) fn residual(task: &Task, sim: &Simulation, leg: Leg, action: &[f64]) -> [f64; NV] {
    // The baseline is needed only for a finite limit.
    let baseline = task.torque_limit.is_finite().then(|| sim.baseline());
    let mirror = task.mirror_for(leg);
    let mut residual = [0.0; NV];
    for (&joint, &a) in task.chosen.iter().zip(action) {
        let (at, sign) = mirror.map_or((joint, 1.0), |mirror| mirror.joints[joint]);
        let torque = sign * task.scale[joint] * a.clamp(-1.0, 1.0);
        residual[at] = match &baseline {
            Some(baseline) => limit_torque(torque, baseline[ROOT + at], task.torque_limit),
            None => torque,
        };
    }
    residual
}

/// Derivatives by one entry of an action.
pub(super) struct ActionSlope {
    /// Coordinate of the joint, and its residual torque without a limit [N m].
    pub joint: usize,
    pub torque: f64,
}

/// Derivatives of `residual` by every entry; zero where an entry is clipped.
pub(super) fn slopes(task: &Task, leg: Leg, action: &[f64]) -> Vec<ActionSlope> {
    let mirror = task.mirror_for(leg);
    let slope = |(&joint, &a): (&usize, &f64)| {
        let (at, sign) = mirror.map_or((joint, 1.0), |mirror| mirror.joints[joint]);
        let is_clipped = !(-1.0..=1.0).contains(&a);
        let torque = if is_clipped {
            0.0
        } else {
            sign * task.scale[joint]
        };
        ActionSlope { joint: at, torque }
    };
    task.chosen.iter().zip(action).map(slope).collect()
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
