//! Forces of the controller on the head, mapped to the joints between the head and the supporting ankle by the
//! transposed Jacobian J_h, and their derivatives. There is none in flight, where no ankle is supported.

use crate::{
    control::{ControllerInput, head::HeadInput, head_damping, lifting},
    dynamics::{kinematics::Kinematics, rnea_derivatives::RneaDerivatives},
    model::{
        Model,
        contact_mode::{ContactMode, SoleContact},
        controller_state::ControllerState,
        controller_terms::Term,
        lanes::ModelLanes,
        layout::{FREE_FOOT, FREE_LOWER_LEG, LOWER_LEG, NV, ROOT, UPPER_LEG, WAIST, coordinate},
    },
    numeric::{
        scalar::{Mask, Scalar},
        twist::Wrench,
        vec3,
    },
};
use nalgebra::Vector3;

/// Sample whether a foot is on the ice.
#[inline(always)]
pub fn sample(mode: ContactMode, controller: &mut ControllerState) {
    controller.supported = mode.support.touch != SoleContact::Air;
}

/// Lanes with a supporting foot on the ice at the last controller sample.
#[inline(always)]
fn supported<T: Scalar>(now: &[ControllerInput]) -> T::Mask {
    T::Mask::from_lanes(|i| now[i].controller.supported)
}

/// Bodies moved by the ankle, knee and hip of the leg that the controller treats as the supporting one.
/// Between a leg swap and the next sample this is the free leg.
#[inline(always)]
fn leg(now: &[ControllerInput]) -> [usize; 3] {
    if now[0].mirrored {
        [FREE_FOOT, FREE_LOWER_LEG, FREE_LOWER_LEG - 1]
    } else {
        [LOWER_LEG, UPPER_LEG, WAIST]
    }
}

impl<'a, T: Scalar> HeadInput<'a, T> {
    #[inline(always)]
    fn of(
        models: impl ModelLanes<T>,
        kin: &'a Kinematics<T>,
        z0: T,
        now: &[ControllerInput],
    ) -> Self {
        Self {
            kin,
            head: kin.psi(models),
            leg: leg(now),
            z0,
        }
    }

    /// Force of the `i`-th term [N].
    #[inline(always)]
    fn force(&self, models: impl ModelLanes<T>, (i, term): (usize, &Term)) -> Vector3<T> {
        match term {
            Term::Lifting(_) => lifting::force(models, i, self),
            Term::HeadDamping(_) => head_damping::force(models, i, self),
            // Torques on joints.
            Term::Feedforward(_) | Term::ArmSwing { .. } => vec3::zero(),
            Term::HipPd(_) | Term::FreeKneePd(_) | Term::KneeStop(_) => vec3::zero(),
        }
    }
}

/// Add the torques of the `i`-th term, a force on the head. Needs `Kinematics::planar_velocities`.
#[inline(always)]
pub fn add_term<T: Scalar>(
    models: impl ModelLanes<T>,
    (i, term): (usize, &Term),
    kin: &mut Kinematics<T>,
    (z0, v): (T, &[T; NV]),
    now: &[ControllerInput],
    tau: &mut [T; NV],
) {
    let (model, supported) = (models.shape(), supported::<T>(now));
    if supported.any() {
        if matches!(term, Term::HeadDamping(_)) {
            kin.head_velocities(model, v);
        }
        let input = HeadInput::of(models, kin, z0, now);
        let force = input.force(models, (i, term));
        add_torques(model, kin, (input.leg, supported), &input.head, &force, tau);
    }
}

/// tau += J_h^T force. J_h is rooted at the supporting ankle, so joint 1 gets no torque.
#[inline(always)]
fn add_torques<T: Scalar>(
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

/// Slopes of all forces on the head along x, y and z, with the sign of a resistance: by its position relative to the
/// target [N/m] and by its velocity relative to the ankle [N s/m].
#[inline(always)]
fn slopes<T: Scalar>(models: impl ModelLanes<T>) -> [Vector3<T>; 2] {
    let [mut K, mut D] = [vec3::zero(); 2];
    for (i, term) in models.shape().controller_terms.iter().enumerate() {
        match term {
            Term::Lifting(_) => K = vec3::add(&K, &lifting::stiffness(models, i)),
            Term::HeadDamping(_) => D = vec3::add(&D, &head_damping::damping(models, i)),
            // Torques on joints.
            Term::Feedforward(_) | Term::ArmSwing { .. } => {}
            Term::HipPd(_) | Term::FreeKneePd(_) | Term::KneeStop(_) => {}
        }
    }
    [K, D]
}

/// Linearisation of the controller's forces on the head, for implicit methods. It is an approximation: the Jacobian
/// and the ankle are held.
#[derive(Debug, Clone, Default)]
pub struct Feedback<T: Scalar = f64> {
    /// Stiffness [N/m] and damping [N s/m] along x, y and z.
    pub K: Vector3<T>,
    pub D: Vector3<T>,
    /// J_h: torque at each joint per unit force on the head along x, y and z. It includes q1, on which the
    /// head's motion depends: a foot that rotates under a leg at rest does not move the head. Coordinates
    /// outside `Model::head_path` have zero entries.
    pub J: [[T; NV]; 3],
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
    [*K, *D] = slopes(models);
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
        let mut unit = vec3::zero();
        unit[i] = T::one();
        add_torques(model, kin, (leg(now), supported), &head, &unit, tau);
        tau[2] = tau[ROOT];
    }
    for i in 0..3 {
        K[i] = T::select(supported, K[i], zero);
        D[i] = T::select(supported, D[i], zero);
    }
    true
}

/// Call `add` with the derivatives of the torques at an evaluation: row, coordinate, and the slopes by its position
/// and velocity. `rnea` has the axes and velocities of the joints, `z0` is the height of the pivot.
pub fn derivatives(
    model: &Model,
    (kin, rnea): (&Kinematics, &RneaDerivatives),
    z0: f64,
    now: &ControllerInput,
    mut add: impl FnMut(usize, usize, [f64; 2]),
) {
    let zero = Vector3::zeros();
    let [stiffness, damping] = slopes::<f64>(model);
    if !now.controller.supported || stiffness == zero && damping == zero {
        return;
    }
    let input = HeadInput::of(model, kin, z0, std::slice::from_ref(now));
    let terms = model.controller_terms.iter().enumerate();
    let force: Vector3<f64> = terms.map(|term| input.force(model, term)).sum();
    let HeadInput { head, leg, .. } = input;
    let ankle = kin.p[leg[0]];
    // Coordinates that move the head and the ankle.
    let (to_head, to_ankle) = (coordinate(model.head.0), coordinate(leg[0]));
    let moves = |c: usize, by: usize| c == by || precedes(model, by, c);
    let twist = |c: usize| &rnea.velocity[c];
    // Joints with their sense in the controller's numbering.
    let sign = if now.mirrored { -1.0 } else { 1.0 };
    let joints = || {
        let legs = leg.iter().map(move |&body| (coordinate(body), sign));
        legs.chain(model.head_chain.iter().map(|&c| (c, 1.0)))
    };
    // The target's height is that above the ice.
    let by_height = Wrench::at(&head, Vector3::new(0.0, 0.0, -stiffness.z));
    for (row, sign) in joints() {
        add(row, 1, [sign * rnea.axis[row].dot(&by_height), 0.0]);
    }
    let wrench = Wrench::at(&head, force);
    for j in 2..model.n {
        let axis = &rnea.axis[j];
        let (mut d_head, mut d_ankle, mut d_relative) = (zero, zero, zero);
        let mut change = |c: usize, p: &Vector3<f64>, sign: f64, dp: &mut Vector3<f64>| {
            if moves(c, j) {
                *dp = axis.at(p);
                let turned = axis.cross(&twist(c).minus(twist(j)));
                d_relative += (turned.at(p) + twist(c).w.cross(dp)) * sign;
            }
        };
        change(to_head, &head, 1.0, &mut d_head);
        change(to_ankle, &ankle, -1.0, &mut d_ankle);
        if d_head == zero && d_ankle == zero {
            continue;
        }
        let moved = Vector3::new(0.0, d_ankle.y, 0.0) - d_head;
        let by_q = stiffness.component_mul(&moved) - damping.component_mul(&d_relative);
        let mut by_q = Wrench::at(&head, by_q);
        by_q.n += d_head.cross(&force);
        let by_v = damping.component_mul(&(d_ankle - d_head));
        let by_v = Wrench::at(&head, by_v);
        let turned = axis.cross_force(&wrench);
        for (row, sign) in joints() {
            let axis = &rnea.axis[row];
            let mut torque = axis.dot(&by_q);
            if precedes(model, j, row) {
                torque -= axis.dot(&turned);
            }
            add(row, j, [sign * torque, sign * axis.dot(&by_v)]);
        }
    }
}

/// Is `a` an ancestor of `c`?
fn precedes(model: &Model, a: usize, c: usize) -> bool {
    model.depth[a] < model.depth[c] && model.ancestors[c][model.depth[a]] == a
}
