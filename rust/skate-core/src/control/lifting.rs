//! Visual lifting, Eqs. 14 and 15, and the damping of the head.

use crate::{
    dynamics::add_point_force,
    kinematics::Kinematics,
    model::{LOWER_LEG, Model, NV, ROOT},
};
use nalgebra::Vector3;

/// tau += J_h^T (K_p (psi_d - psi) - damping), J_h rooted at the supporting ankle: joint 1 is free.
pub fn add(model: &Model, kin: &Kinematics, z0: f64, tau: &mut [f64; NV]) {
    let lifting = &model.scene.control.lifting;
    let damping = &model.scene.helpers.head_damping;
    if lifting.is_none() && damping.is_none() {
        return;
    }
    let head = kin.head(model);
    let ankle = kin.ankle();
    let mut force = Vector3::zeros();
    if let Some(lifting) = lifting {
        // Height counts from the ice, not from the pivot.
        let target = Vector3::new(0.0, ankle.y + lifting.ahead, lifting.height - z0);
        force = Vector3::from(lifting.K_p).component_mul(&(target - head));
    }
    if let Some(damping) = damping {
        let velocity =
            kin.point_velocity(model.head.0, &head) - kin.point_velocity(LOWER_LEG, &ankle);
        force.y -= damping.y * velocity.y;
        force.z -= damping.z * velocity.z;
    }
    add_point_force(model, kin, (model.head.0, &head), &force, ROOT, tau);
}
