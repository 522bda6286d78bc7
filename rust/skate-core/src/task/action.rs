//! Mapping from actions to residual torques.

use crate::{
    model::layout::{NV, ROOT},
    scene::Leg,
    sim::Simulation,
    task::Task,
};

/// Residual torques of an action [N m] and its mean square. `leg` supported when the action was chosen.
pub(super) fn residual(
    task: &Task,
    sim: &Simulation,
    leg: Leg,
    action: &[f64],
) -> ([f64; NV], f64) {
    // The baseline is needed only for a finite limit.
    let baseline = task.torque_limit.is_finite().then(|| sim.baseline());
    let mirror = task.mirror_for(leg);
    let mut residual = [0.0; NV];
    let mut effort = 0.0;
    for (&joint, &a) in task.chosen.iter().zip(action) {
        let a = a.clamp(-1.0, 1.0);
        effort += a * a / task.joints() as f64;
        let (at, sign) = mirror.map_or((joint, 1.0), |mirror| mirror.joints[joint]);
        let torque = sign * task.scale[joint] * a;
        residual[at] = match &baseline {
            Some(baseline) => limit_torque(torque, baseline[ROOT + at], task.torque_limit),
            None => torque,
        };
    }
    (residual, effort)
}

/// Derivatives of `residual` without a limit: coordinate of the joint and its torque, by entry of the action [N m].
/// Zero where an entry is clipped.
pub(super) fn gradient(
    task: &Task,
    leg: Leg,
    action: &[f64],
) -> impl Iterator<Item = (usize, f64)> {
    let mirror = task.mirror_for(leg);
    task.chosen.iter().zip(action).map(move |(&joint, &a)| {
        let (at, sign) = mirror.map_or((joint, 1.0), |mirror| mirror.joints[joint]);
        let torque = if is_clipped(a) {
            0.0
        } else {
            sign * task.scale[joint]
        };
        (at, torque)
    })
}

/// Whether an entry of an action exceeds its range.
pub(super) fn is_clipped(a: f64) -> bool {
    !(-1.0..=1.0).contains(&a)
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
