//! Selection of the contact mode.

use crate::strategies::{config, friction, vector};
use nalgebra::{Matrix3, Vector3};
use proptest::prelude::*;
use skate_core::{
    contact::{
        conditions::{Tolerance, admissibility},
        equations::{ContactProblem, PHI, Slip, Solution, Y, Z},
        mode_query::ModeQuery,
        mode_selection::{consistent, select},
    },
    error::Termination,
    model::{
        Model,
        contact_mode::{ContactMode, Foot, SoleContact},
        friction::FrictionMode,
        layout::NV,
    },
    rhs::{Evaluation, StepContext},
    scene::{ContactLaw, PulledFriction, Scene},
    sim::Simulation,
};

/// Tolerance of zero [N], [m/s2].
const ZERO: Tolerance = Tolerance {
    force: 1e-7,
    motion: 1e-8,
};

fn touch() -> impl Strategy<Value = SoleContact> {
    prop::sample::select(&[
        SoleContact::Air,
        SoleContact::Heel,
        SoleContact::Toe,
        SoleContact::Flat,
    ])
}

fn friction_mode() -> impl Strategy<Value = FrictionMode> {
    prop::sample::select(&[
        FrictionMode::Stuck,
        FrictionMode::Forward,
        FrictionMode::Backward,
    ])
}

/// Contact problem of a random posture with the given contacts.
fn problem(
    model: &Model,
    closed: [SoleContact; 2],
    q: &[f64; NV],
    v: &[f64; NV],
    torque: &[f64; NV],
) -> ContactProblem {
    let mut state = Simulation::new(model.clone()).expect("standing").state;
    state.mode = ContactMode {
        support: Foot::new(closed[0], FrictionMode::Stuck),
        free: Foot::new(closed[1], FrictionMode::Stuck),
    };
    let mut residual = *torque;
    residual[..3].fill(0.0);
    let mut eval = Evaluation::default();
    eval.set_configuration(model, closed[0], q, v);
    eval.assemble(model, closed[1]);
    eval.assemble_loads(model, q, v, &StepContext::of(model, &state, &residual));
    eval.factored.problem
}

/// Motion and force of a foot, moved from the reference point of the contact problem to the other end of
/// the sole, at the distance `by` in front.
fn at_other_end(
    motion: Vector3<f64>,
    force: Vector3<f64>,
    by: f64,
) -> (Vector3<f64>, Vector3<f64>) {
    let mut X = Matrix3::identity();
    X[(Z, PHI)] = by;
    let back = X.transpose().try_inverse().expect("a shear");
    (X * motion, back * force)
}

/// Motion and force of both feet at the reference points of the contact problem.
fn at_reference_points(
    [support, free]: [f64; 2],
    closed: [SoleContact; 2],
    mode: ContactMode,
    found: &Solution,
) -> Solution {
    let mut moved = *found;
    if closed[0] == SoleContact::Flat && mode.support.touch == SoleContact::Heel {
        (moved.a_root, moved.f_root) = at_other_end(found.a_root, found.f_root, support);
    }
    if closed[1] == SoleContact::Flat && mode.free.touch == SoleContact::Toe {
        (moved.a_free, moved.lam) = at_other_end(found.a_free, found.lam, -free);
    }
    moved
}

proptest! {
    #![proptest_config(config(3_000))]

    /// The selected mode satisfies the equations of motion and the contact laws: at each end, either a
    /// compressive force or a separating acceleration; for each foot, sticking inside the cone or sliding
    /// on its edge.
    #[test]
    fn the_selected_mode_satisfies_the_contact_laws(
        closed in [touch(), touch()], friction_modes in [friction_mode(), friction_mode()], moves in any::<[bool; 2]>(),
        push_only in any::<bool>(), literal in any::<bool>(), friction in friction(),
        q in vector(0.8), v in vector(2.0), torque in vector(100.0),
    ) {
        let mut scene = Scene::default();
        scene.ice.friction = friction;
        if push_only {
            scene.contact.law = ContactLaw::PushOnly;
        } else if !literal {
            scene.contact.pulled_friction = PulledFriction::None;
        }
        let model = Model::compile(&scene).expect("a model");
        let problem = problem(&model, closed, &q, &v, &torque);
        let foot = |which: usize| Foot::new(closed[which], friction_modes[which]);
        let near = ContactMode { support: foot(0), free: foot(1) };
        let moving = [0, 1].map(|which| (moves[which] && foot(which).slides()).then_some(friction_modes[which]));
        let query = ModeQuery::new(closed, moving, near, ZERO);
        let chosen = select(&model, &problem, &query);
        let (mode, found) = match chosen {
            Ok(chosen) => chosen,
            Err(why) => {
                prop_assert!(matches!(why, Termination::Jam | Termination::Singular));
                return Ok(());
            }
        };
        // The selection is deterministic and idempotent.
        prop_assert_eq!(select(&model, &problem, &query).expect("as before").0, mode);
        let again = ModeQuery { reference: mode, ..query };
        prop_assert_eq!(select(&model, &problem, &again).expect("as before").0, mode);

        let moved = at_reference_points(problem.lever, closed, mode, &found);
        let Solution { a_root, f_root, a_free, lam } = moved;
        let on_root = problem.S * a_root - problem.b - f_root - problem.G.transpose() * lam;
        let on_foot = problem.G * a_root + problem.W * lam + problem.alpha0 - a_free;
        let sizes = [f_root, lam, a_root, a_free, problem.b, problem.alpha0].map(|x| x.amax());
        let scale = 1.0 + sizes.iter().sum::<f64>();
        // Measured at most 6e-16 of the terms of the sum.
        prop_assert!(on_root.amax() < 1e-12 * scale, "{on_root}");
        prop_assert!(closed[1] == SoleContact::Air || on_foot.amax() < 1e-12 * scale, "{on_foot}");

        let slack = 1e-9 * scale;
        for which in 0..2 {
            let length = problem.lever[which];
            let foot = [mode.support, mode.free][which];
            let (motion, force) = [(found.a_root, found.f_root), (found.a_free, found.lam)][which];
            if closed[which] == SoleContact::Air {
                prop_assert_eq!(foot, Foot::AIR);
                continue;
            }
            // Vertical accelerations and loads of heel and toe. The reference point of the supporting foot
            // is its toe unless only the heel touches; that of the free foot is its heel unless only the
            // toe touches.
            let at_toe = match which {
                0 => foot.touch != SoleContact::Heel && closed[0] != SoleContact::Heel,
                _ => foot.touch == SoleContact::Toe && closed[1] == SoleContact::Flat || closed[1] == SoleContact::Toe,
            };
            let (rise, load) = if at_toe {
                let heel = -force[PHI] / length;
                ([motion[Z] - length * motion[PHI], motion[Z]], [heel, force[Z] - heel])
            } else {
                let toe = force[PHI] / length;
                ([motion[Z], motion[Z] + length * motion[PHI]], [force[Z] - toe, toe])
            };
            for end in 0..2 {
                let (is_closed, acts) = [
                    (closed[which].heel(), foot.touch.heel()),
                    (closed[which].toe(), foot.touch.toe()),
                ][end];
                prop_assert!(is_closed || !acts);
                if acts {
                    prop_assert!(rise[end].abs() <= slack, "{rise:?}");
                    prop_assert!(!push_only || load[end] >= -ZERO.force - slack, "{load:?}");
                } else {
                    prop_assert!(load[end].abs() <= slack, "{load:?}");
                    prop_assert!(!push_only || !is_closed || rise[end] >= -ZERO.motion - slack, "{rise:?}");
                }
            }
            if foot.touch == SoleContact::Air {
                continue;
            }
            let normal = force[Z];
            let [mu_forward, mu_backward] = model.friction.mu;
            match foot.friction_mode {
                FrictionMode::Stuck => {
                    prop_assert!(motion[Y].abs() <= slack);
                    prop_assert!(force[Y] >= -mu_forward * normal.max(0.0) - ZERO.force - slack);
                    prop_assert!(force[Y] <= mu_backward * normal.max(0.0) + ZERO.force + slack);
                }
                FrictionMode::Forward | FrictionMode::Backward => {
                    let forward = foot.friction_mode == FrictionMode::Forward;
                    let ratio = if forward { -mu_forward } else { mu_backward };
                    let ratio = if foot.pulled { 0.0 } else { ratio };
                    prop_assert!((force[Y] - ratio * normal).abs() <= slack, "{force:?}");
                    match moving[which] {
                        Some(given) => prop_assert_eq!(foot.friction_mode, given),
                        None => prop_assert!(foot.friction_mode.sign() * motion[Y] >= -ZERO.motion - slack),
                    }
                }
                FrictionMode::Frictionless => prop_assert!(false, "dry friction"),
            }
        }
    }

    /// A decision by signs alone agrees with the full check.
    #[test]
    fn decisions_by_sign_agree_with_the_full_check(
        closed in [touch(), touch()], friction_modes in [friction_mode(), friction_mode()], pulled in any::<[bool; 2]>(),
        push_only in any::<bool>(), friction in friction(),
        q in vector(0.8), v in vector(2.0), torque in vector(100.0),
    ) {
        let mut scene = Scene::default();
        scene.ice.friction = friction;
        if push_only {
            scene.contact.law = ContactLaw::PushOnly;
        }
        let model = Model::compile(&scene).expect("a model");
        let problem = problem(&model, closed, &q, &v, &torque);
        let foot = |which: usize| {
            let foot = Foot::new(closed[which], friction_modes[which]);
            Foot { pulled: pulled[which] && foot.slides() && !push_only, ..foot }
        };
        let mode = ContactMode { support: foot(0), free: foot(1) };
        let query = ModeQuery::new(closed, [None; 2], mode, ZERO);
        let Ok(solution) = problem.solve(mode, Slip::of(&model, mode)) else {
            return Ok(());
        };
        let admissibility = admissibility(&model, (problem.lever, &solution), mode, ZERO);
        prop_assert!(!(admissibility.holds && admissibility.fails));
        if let Ok(found) = consistent(&model, &problem, &query, mode) {
            prop_assert!(!admissibility.holds || found.is_some());
            prop_assert!(!admissibility.fails || found.is_none());
        }
    }
}
