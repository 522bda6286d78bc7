//! Visual lifting, Eqs. 14 and 15, and damping of the head: forces on the head, mapped to the joints
//! between the head and the supporting ankle by the transposed Jacobian.

use crate::{
    control::ControllerInput,
    dynamics::kinematics::Kinematics,
    model::{
        Model,
        controller_terms::Term,
        lanes::ModelLanes,
        layout::{FREE_FOOT, FREE_LOWER_LEG, LOWER_LEG, NV, ROOT, UPPER_LEG, WAIST},
    },
    numeric::{
        scalar::{Mask, Scalar},
        vec3,
    },
};
use nalgebra::Vector3;

/// K_p, `ahead` and `height` of term `i`.
#[inline(always)]
fn gains<T: Scalar>(models: impl ModelLanes<T>, i: usize) -> (Vector3<T>, T, T) {
    let number = |of: fn(&crate::scene::Lifting) -> f64| {
        models.number(|m| match &m.controller_terms[i] {
            Term::Lifting(law) => of(law),
            _ => 0.0,
        })
    };
    let K = Vector3::new(
        number(|law| law.K_p[0]),
        number(|law| law.K_p[1]),
        number(|law| law.K_p[2]),
    );
    (K, number(|law| law.ahead), number(|law| law.height))
}

/// Damping along y and z of term `i`.
#[inline(always)]
fn damping<T: Scalar>(models: impl ModelLanes<T>, i: usize) -> (T, T) {
    let number = |of: fn(&crate::scene::HeadDamping) -> f64| {
        models.number(|m| match &m.controller_terms[i] {
            Term::HeadDamping(law) => of(law),
            _ => 0.0,
        })
    };
    (number(|law| law.y), number(|law| law.z))
}

/// Lanes with a supporting foot on the ice at the last controller sample.
#[inline(always)]
fn supported<T: Scalar>(now: &[ControllerInput]) -> T::Mask {
    T::Mask::from_lanes(|i| now[i].controller.supported)
}

/// tau += J_h^T K_p (psi_d - psi), by term `i`. There is no torque in flight, where no ankle is supported.
#[inline(always)]
pub fn lift<T: Scalar>(
    models: impl ModelLanes<T>,
    kin: &Kinematics<T>,
    i: usize,
    z0: T,
    now: &[ControllerInput],
    tau: &mut [T; NV],
) {
    let supported = supported::<T>(now);
    if !supported.any() {
        return;
    }
    let (K_p, ahead, height) = gains(models, i);
    let (head, leg) = (kin.psi(models), leg(now));
    // The target height is measured from the ice, not from the pivot.
    let target = Vector3::new(T::zero(), kin.p[leg[0]].y + ahead, height - z0);
    let force = vec3::mul(&K_p, &vec3::sub(&target, &head));
    add(models.shape(), kin, (leg, supported), &head, &force, tau);
}

/// tau -= J_h^T D psi', by term `i`.
#[inline(always)]
pub fn damp<T: Scalar>(
    models: impl ModelLanes<T>,
    kin: &mut Kinematics<T>,
    i: usize,
    v: &[T; NV],
    now: &[ControllerInput],
    tau: &mut [T; NV],
) {
    let supported = supported::<T>(now);
    if !supported.any() {
        return;
    }
    let model = models.shape();
    kin.head_velocities(model, v);
    let (head, leg) = (kin.psi(models), leg(now));
    let ankle = kin.point_velocity(leg[0], &kin.p[leg[0]]);
    let velocity = vec3::sub(&kin.point_velocity(model.head.0, &head), &ankle);
    let (y, z) = damping(models, i);
    let force = Vector3::new(T::zero(), -y * velocity.y, -z * velocity.z);
    add(model, kin, (leg, supported), &head, &force, tau);
}

/// Linearisation of the controller's forces on the head, for implicit methods.
#[derive(Debug, Clone)]
pub struct Feedback<T: Scalar = f64> {
    /// Stiffness [N/m] and damping [N s/m] along x, y and z.
    pub K: Vector3<T>,
    pub D: Vector3<T>,
    /// J_h: torque at each joint per unit force on the head along x, y and z. It includes q1, on which the
    /// head's motion depends: a foot that rotates under a leg at rest does not move the head. Coordinates
    /// outside `Model::head_path` have zero entries.
    pub J: [[T; NV]; 3],
}

impl<T: Scalar> Default for Feedback<T> {
    fn default() -> Self {
        Self {
            K: vec3::zero(),
            D: vec3::zero(),
            J: [[T::zero(); NV]; 3],
        }
    }
}

/// False if the controller exerts no force on the head. After a leg swap, and until the controller's next
/// sample (at most 1 ms), the joints are numbered from the other foot; the forces are then treated
/// explicitly.
#[inline(always)]
pub fn feedback<T: Scalar>(
    models: impl ModelLanes<T>,
    kin: &Kinematics<T>,
    now: &[ControllerInput],
    Feedback { K, D, J }: &mut Feedback<T>,
) -> bool {
    let (model, supported) = (models.shape(), supported::<T>(now));
    if !supported.any() || now[0].mirrored {
        return false;
    }
    let zero = T::zero();
    let none = Vector3::new(zero, zero, zero);
    (*K, *D) = (none, none);
    for (i, term) in model.controller_terms.iter().enumerate() {
        match term {
            Term::Lifting(_) => *K = vec3::add(K, &gains(models, i).0),
            Term::HeadDamping(_) => {
                let (y, z) = damping(models, i);
                *D = vec3::add(D, &Vector3::new(zero, y, z));
            }
            _ => {}
        }
    }
    let mut acts = false;
    for x in [&*K, &*D] {
        for x in x {
            acts |= !x.le(zero).all() || !x.ge(zero).all();
        }
    }
    if !acts {
        return false;
    }
    let head = kin.psi(models);
    for (i, tau) in J.iter_mut().enumerate() {
        for &c in &model.head_path {
            tau[c] = zero;
        }
        let mut unit = none;
        unit[i] = T::one();
        add(model, kin, (leg(now), supported), &head, &unit, tau);
        tau[2] = tau[ROOT];
    }
    for i in 0..3 {
        K[i] = T::select(supported, K[i], zero);
        D[i] = T::select(supported, D[i], zero);
    }
    true
}

/// Bodies moved by the ankle, knee and hip of the leg that the controller treats as the supporting one.
/// Between a leg swap and the next sample this is the free leg.
pub fn leg(now: &[ControllerInput]) -> [usize; 3] {
    if now[0].mirrored {
        [FREE_FOOT, FREE_LOWER_LEG, FREE_LOWER_LEG - 1]
    } else {
        [LOWER_LEG, UPPER_LEG, WAIST]
    }
}

/// tau += J_h^T force. J_h is rooted at the supporting ankle, so joint 1 gets no torque.
#[inline(always)]
fn add<T: Scalar>(
    model: &Model,
    kin: &Kinematics<T>,
    (leg, supported): ([usize; 3], T::Mask),
    head: &Vector3<T>,
    force: &Vector3<T>,
    tau: &mut [T; NV],
) {
    let moment = vec3::cross(head, force);
    for (i, body) in leg.into_iter().enumerate() {
        let torque = kin.along(model, body, force, &moment);
        tau[ROOT + i] += T::select(supported, torque, T::zero());
    }
    for &c in &model.head_chain {
        let torque = kin.along(model, c - 2, force, &moment);
        tau[c] += T::select(supported, torque, T::zero());
    }
}
