//! Derivatives of the operations of events, but for projections, by the operations themselves on dual numbers.

use crate::{
    contact::equations::Slip,
    derivatives::{parameters::Varied, variation::Variation},
    events::{leg_swap, observer::Operation},
    model::{
        Model,
        contact_mode::ContactMode,
        lanes::{Broadcast, ModelLanes},
        layout::{NV, reverse_legs},
    },
    numeric::{dual::Dual, scalar::Scalar, simd::Register, trig::sin_cos_of, vec3},
    rhs::{Evaluation, Stance, ankle_to_point, pivot_to_ankle},
};
use nalgebra::Vector3;

/// What the operations change.
#[derive(Clone)]
struct Changing<T> {
    q: [T; NV],
    v: [T; NV],
    anchor: T,
}

impl<T: Scalar> Changing<T> {
    /// Apply one of these operations; others have no effect.
    #[inline(always)]
    fn apply(
        &mut self,
        models: impl ModelLanes<T>,
        eval: &mut Evaluation<T>,
        operation: Operation,
    ) {
        let Self { q, v, anchor } = self;
        match operation {
            Operation::MovePivot { from, to } => {
                let along =
                    models.number(|m| pivot_to_ankle(m, from)[0] - pivot_to_ankle(m, to)[0]);
                leg_swap::translate_pivot(along, sin_cos_of(q[2]), q, v);
            }
            Operation::Swap(mode, support) => {
                set_legs(models, eval, mode, (&*q, &*v));
                leg_swap::swap_coordinates(models, &eval.kin, support.touch, q, v);
            }
            Operation::Impact { mode, has_friction } => {
                let slip = match has_friction {
                    true => Slip::of(models, mode),
                    false => Slip::default(),
                };
                impact(models, eval, (mode, slip), (&*q, v));
            }
            Operation::ZeroConstrained(mode) => mode.support.zero_constrained(q, v),
            Operation::SetAnchor(mode) => {
                set_legs(models, eval, mode, (&*q, &*v));
                let along = models.number(|m| ankle_to_point(m, mode.free.touch));
                *anchor = q[0] + eval.kin.sole_point(models, along).y;
            }
            _ => {}
        }
    }
}

/// Inelastic impact; see `EventHandler::apply_impact_with`.
#[inline(always)]
fn impact<T: Scalar>(
    models: impl ModelLanes<T>,
    eval: &mut Evaluation<T>,
    (mode, slip): (ContactMode, Slip<T>),
    (q, v): (&[T; NV], &mut [T; NV]),
) {
    let stance = Stance::of(models, mode);
    eval.update_kinematics(models, &stance, q, v);
    eval.factor(models, stance.rows, None);
    let root = Vector3::new(v[0], v[1], v[2]);
    let point = Vector3::from(eval.point_velocity);
    let problem = &mut eval.factored.problem;
    problem.b = vec3::apply(&problem.S, &root);
    if stance.rows > 0 {
        problem.alpha0 = vec3::sub(&point, &vec3::apply(&problem.G, &root));
    }
    let (solution, _) = problem.regular(mode, slip);
    let change = vec3::sub(&solution.a_root, &root);
    let change = eval.response(models, &change, &solution.lam);
    for (v, change) in v.iter_mut().zip(change) {
        *v += *change;
    }
}

/// Poses and velocities of the legs in the frame of `mode`.
#[inline(always)]
fn set_legs<T: Scalar>(
    models: impl ModelLanes<T>,
    eval: &mut Evaluation<T>,
    mode: ContactMode,
    (q, v): (&[T; NV], &[T; NV]),
) {
    eval.update_leg_kinematics(models, &Stance::of(models, mode), q);
    eval.kin.planar_velocities(models.shape(), v);
}

/// Positions, velocities and anchor after an operation.
fn changed_state(
    mut state: Changing<f64>,
    model: &Model,
    eval: &mut Evaluation,
    operation: Operation,
) -> [f64; 2 * NV + 1] {
    state.apply(model, eval, operation);
    let mut all = [state.anchor; 2 * NV + 1];
    all[..NV].copy_from_slice(&state.q);
    all[NV..2 * NV].copy_from_slice(&state.v);
    all
}

/// Apply one of the operations to all directions. `eval` is a workspace, and `other_eval` one for the models of other
/// parameters.
pub fn change_state<R: Register>(
    Varied { model, parameters }: Varied<'_>,
    operation: Operation,
    (eval, other_eval): (&mut Evaluation<Dual<R>>, &mut Evaluation),
    states: &mut [&mut Variation<R>],
) {
    let Some(first) = states.first() else {
        return;
    };
    let start = Changing {
        q: first.q.map(|q| q.x),
        v: first.v.map(|v| v.x),
        anchor: first.anchor.x,
    };
    let by_parameter =
        parameters.slopes(|other| changed_state(start.clone(), other, other_eval, operation));
    R::with_target_features(
        #[inline(always)]
        || {
            for x in states {
                let mut changing = Changing {
                    q: x.q,
                    v: x.v,
                    anchor: x.anchor,
                };
                changing.apply(Broadcast(model), eval, operation);
                let Changing { q, v, anchor } = &mut changing;
                if let Some(explicit) = by_parameter.along::<R>(x.parameter) {
                    let all = q.iter_mut().chain(v).chain([anchor]);
                    for (entry, explicit) in all.zip(explicit) {
                        entry.d += explicit;
                    }
                }
                (x.q, x.v, x.anchor) = (changing.q, changing.v, changing.anchor);
                if let Operation::Swap(..) = operation {
                    reverse_legs(&mut x.residual);
                }
            }
        },
    );
}
