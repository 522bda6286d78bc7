//! Visual lifting, Eqs. 14 and 15, and the damping of the head: forces on the head, made by the joints
//! between it and the supporting ankle.

use super::{Situation, Term};
use crate::{
    kinematics::Kinematics,
    model::{FREE_FOOT, FREE_LOWER_LEG, LOWER_LEG, Model, NV, ROOT, UPPER_LEG, WAIST},
    scene::{HeadDamping, Lifting},
};
use nalgebra::Vector3;

/// tau += J_h^T K_p (psi_d - psi); in flight there is no ankle to count from.
#[inline(never)]
pub fn lift(
    model: &Model,
    kin: &Kinematics,
    law: &Lifting,
    z0: f64,
    now: &Situation,
    tau: &mut [f64; NV],
) {
    if !now.clock.supported {
        return;
    }
    let (head, leg) = (kin.head(model), leg(now));
    // Height counts from the ice, not from the pivot.
    let target = Vector3::new(0.0, kin.p[leg[0]].y + law.ahead, law.height - z0);
    let force = Vector3::from(law.K_p).component_mul(&(target - head));
    add(model, kin, leg, &head, &force, tau);
}

/// tau -= J_h^T D psi'.
#[inline(never)]
pub fn damp(
    model: &Model,
    kin: &mut Kinematics,
    law: &HeadDamping,
    v: &[f64; NV],
    now: &Situation,
    tau: &mut [f64; NV],
) {
    if !now.clock.supported {
        return;
    }
    kin.head_velocities(model, v);
    let (head, leg) = (kin.head(model), leg(now));
    let ankle = kin.point_velocity(leg[0], &kin.p[leg[0]]);
    let velocity = kin.point_velocity(model.head.0, &head) - ankle;
    let force = Vector3::new(0.0, -law.y * velocity.y, -law.z * velocity.z);
    add(model, kin, leg, &head, &force, tau);
}

/// How the controller's forces on the head answer to its motion, for methods that are implicit in them.
#[derive(Debug, Clone)]
pub struct Feedback {
    /// Stiffness [N/m] and damping [N s/m] along x, y and z.
    pub K: Vector3<f64>,
    pub D: Vector3<f64>,
    /// J_h: what a unit force on the head along x, y and z comes to at each joint. Here q1 counts, too,
    /// as it does for the head's motion: a foot that turns under a leg at rest does not move the head.
    pub J: [[f64; NV]; 3],
}

/// None where the controller exerts no force on the head. One that has not yet noticed a swap counts the
/// joints from the other foot; it will within a millisecond, and is explicit until then.
pub fn feedback(model: &Model, kin: &Kinematics, now: &Situation) -> Option<Feedback> {
    if !now.clock.supported || now.mirrored {
        return None;
    }
    let [mut K, mut D] = [Vector3::zeros(); 2];
    for term in &model.controller {
        match term {
            Term::Lifting(law) => K += Vector3::from(law.K_p),
            Term::HeadDamping(law) => D += Vector3::new(0.0, law.y, law.z),
            _ => {}
        }
    }
    if K == Vector3::zeros() && D == Vector3::zeros() {
        return None;
    }
    let head = kin.head(model);
    let J = std::array::from_fn(|i| {
        let mut tau = [0.0; NV];
        add(model, kin, leg(now), &head, &Vector3::ith(i, 1.0), &mut tau);
        tau[2] = tau[ROOT];
        tau
    });
    Some(Feedback { K, D, J })
}

/// The bodies that the ankle, the knee and the hip of the leg turn. Where the controller has not yet
/// noticed a swap it is the free foot's leg.
fn leg(now: &Situation) -> [usize; 3] {
    if now.mirrored {
        [FREE_FOOT, FREE_LOWER_LEG, FREE_LOWER_LEG - 1]
    } else {
        [LOWER_LEG, UPPER_LEG, WAIST]
    }
}

/// tau += J_h^T force, J_h rooted at the supporting ankle: joint 1 is free.
#[inline(always)]
fn add(
    model: &Model,
    kin: &Kinematics,
    leg: [usize; 3],
    head: &Vector3<f64>,
    force: &Vector3<f64>,
    tau: &mut [f64; NV],
) {
    let moment = head.cross(force);
    for (i, body) in leg.into_iter().enumerate() {
        tau[ROOT + i] += kin.along(model, body, force, &moment);
    }
    for &c in &model.head_chain {
        tau[c] += kin.along(model, c - 2, force, &moment);
    }
}
