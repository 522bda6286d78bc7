//! Visual lifting, Eqs. 14 and 15, and the damping of the head.

use crate::{
    kinematics::Kinematics,
    model::{FREE_FOOT, FREE_LOWER_LEG, LOWER_LEG, Model, NV, ROOT, UPPER_LEG, WAIST},
};
use nalgebra::Vector3;

/// tau += J_h^T (K_p (psi_d - psi) - damping), J_h rooted at the supporting ankle: joint 1 is free.
/// Where the controller has not yet noticed a swap, that is the free foot's ankle (`mirrored`).
pub fn add(model: &Model, kin: &Kinematics, z0: f64, mirrored: bool, tau: &mut [f64; NV]) {
    let lifting = &model.scene.control.lifting;
    let damping = &model.scene.helpers.head_damping;
    if lifting.is_none() && damping.is_none() {
        return;
    }
    let head = kin.head(model);
    // The bodies that the ankle, the knee and the hip of the leg turn.
    let leg = if mirrored {
        [FREE_FOOT, FREE_LOWER_LEG, FREE_LOWER_LEG - 1]
    } else {
        [LOWER_LEG, UPPER_LEG, WAIST]
    };
    let ankle = kin.p[leg[0]];
    let mut force = Vector3::zeros();
    if let Some(lifting) = lifting {
        // Height counts from the ice, not from the pivot.
        let target = Vector3::new(0.0, ankle.y + lifting.ahead, lifting.height - z0);
        force = Vector3::from(lifting.K_p).component_mul(&(target - head));
    }
    if let Some(damping) = damping {
        let velocity = kin.point_velocity(model.head.0, &head) - kin.point_velocity(leg[0], &ankle);
        force.y -= damping.y * velocity.y;
        force.z -= damping.z * velocity.z;
    }
    let moment = head.cross(&force);
    for (i, body) in leg.into_iter().enumerate() {
        tau[ROOT + i] += kin.along(model, body, &force, &moment);
    }
    for &c in &model.head_chain {
        tau[c] += kin.along(model, c - 2, &force, &moment);
    }
}
