//! Right-hand side and projections against the same operations on dual numbers.

use super::{
    inputs::{COLUMNS, position, times, torque, velocity},
    jacobian::{Differentiator, Jacobian, ROWS},
};
use crate::{
    contact::equations::Slip,
    control::{feedforward::start_of, open_loop_torques},
    derivatives::{
        parameters::{Parameters, Varied},
        variation::Variation,
    },
    model::{
        Model,
        contact_mode::{ContactMode, SoleContact},
        controller_state::{ControllerState, Phase},
        lanes::Broadcast,
        layout::{NV, ROOT},
        state::State,
    },
    numeric::{dual::Dual, vec3},
    rhs::{
        Evaluation, Stance, StepContext, Torques,
        projection::{PositionConstraints, project, violation},
    },
    scene::{HeadDamping, KneeStop, Leg, ProportionalDerivative, Scene},
    sim::Simulation,
};
use rand::{Rng, SeedableRng, rngs::StdRng};

/// Presets with every term of the controller.
fn models() -> Vec<Model> {
    let presets = [
        include_str!("../../../../../skate_env/scenes/paper.toml"),
        include_str!("../../../../../skate_env/scenes/paper_arms.toml"),
        include_str!("../../../../../skate_env/scenes/push_only.toml"),
        include_str!("../../../../../skate_env/studies/scenes/blade.toml"),
    ];
    let compiled = |preset: &&str| {
        let mut scene = Scene::from_toml(preset).expect("a preset");
        scene.stabilizers.head_damping = Some(HeadDamping { y: 30.0, z: 7.0 });
        scene.stabilizers.hip_pd = Some(ProportionalDerivative::new(50.0, 3.0));
        scene.stabilizers.free_knee_pd = Some(ProportionalDerivative::new(20.0, 2.0));
        scene.stabilizers.knee_stop = Some(KneeStop {
            stiffness: 300.0,
            damping: 0.4,
        });
        Model::compile(&scene).expect("a model")
    };
    presets.iter().map(compiled).collect()
}

/// Call `each` with states in every mode and random torques.
fn for_states(mut each: impl FnMut(&Model, &State, &[f64; NV])) {
    let mut rng = StdRng::seed_from_u64(1);
    for model in &models() {
        let start = Simulation::new(model.clone()).expect("a start").state;
        for mode in model.modes() {
            for mirrored in [false, true] {
                let mut state = start;
                state.mode = mode;
                let mut draw = |size: f64| rng.random_range(-size..size);
                state.t = 0.37;
                for c in 1..model.n {
                    state.q[c] += draw(0.3);
                    state.v[c] = draw(2.0);
                }
                let mut residual = [0.0; NV];
                residual[ROOT..model.n].fill_with(|| draw(5.0));
                state.controller = ControllerState {
                    t0: 0.1,
                    t1: 0.2,
                    t2: 0.3,
                    phase: Phase::of(mode),
                    leg: match mirrored {
                        true => Leg::Left,
                        false => Leg::Right,
                    },
                    supported: true,
                    tau7: 40.0,
                };
                state.support_leg = Leg::Right;
                each(model, &state, &residual);
            }
        }
    }
}

/// The Jacobian at a state; None for dependent constraints.
fn jacobian(varied: Varied<'_>, state: &State, residual: &[f64; NV]) -> Option<Jacobian> {
    let context = StepContext::of(varied.model, state, residual);
    let mut found = Jacobian::default();
    let at = (state.t, &state.q, &state.v);
    Differentiator::<f64>::default().update(varied, &context, at, &mut found);
    found.regular.then_some(found)
}

/// Largest difference of columns, relative to the largest entry of its row, of at least 1.
fn largest_difference(found: &[[f64; ROWS]], exact: &[[f64; ROWS]]) -> f64 {
    let mut worst: f64 = 0.0;
    for row in 0..ROWS {
        // The forces have one scale.
        let rows = if row < NV { row..row + 1 } else { NV..ROWS };
        let all = exact.iter().flat_map(|column| &column[rows.clone()]);
        let size = all.fold(1.0_f64, |size, x| size.max(x.abs()));
        for (found, exact) in found.iter().zip(exact) {
            worst = worst.max((found[row] - exact[row]).abs() / size);
        }
    }
    worst
}

/// Every column equals the derivative on dual numbers, in every mode and with every term of the controller.
/// The largest difference is 1.1e-10, with almost dependent constraints.
#[test]
fn columns_are_those_of_dual_numbers() {
    let (mut worst, mut tried) = (0.0_f64, 0);
    for_states(|model, state, residual| {
        let parameters = Parameters::default();
        let varied = Varied {
            model,
            parameters: &parameters,
        };
        if let Some(mut found) = jacobian(varied, state, residual) {
            let exact = dual_columns(model, state, residual, &mut found);
            worst = worst.max(largest_difference(&found.columns, &exact));
            tried += 1;
        }
    });
    assert!(worst < 5e-10, "{worst:e}");
    assert!(tried > 50, "{tried}");
}

/// Columns on dual numbers. Where both times count from the leg swap, those that were found are added.
fn dual_columns(
    model: &Model,
    state: &State,
    residual: &[f64; NV],
    found: &mut Jacobian,
) -> [[f64; ROWS]; COLUMNS] {
    let (n, models) = (model.n, Broadcast(model));
    let context = StepContext::of(model, state, residual);
    let now = std::slice::from_ref(&context.now);
    let stance = Stance::of(models, context.mode);
    let feedforward = open_loop_torques(models, now);
    let slip = Slip::of(models, context.mode);
    let mut eval = Box::<Evaluation<Dual<f64>>>::default();
    let mut exact = [[0.0; ROWS]; COLUMNS];
    let mut column = |vary: &dyn Fn(&mut Variation<f64>), at: usize| {
        let mut x = Variation::<f64>::of(state, residual);
        vary(&mut x);
        let input = x.open_loop(&context.now.controller);
        let (torque, _) = input.torques(models, context.now.mirrored);
        for (residual, torque) in x.residual.iter_mut().zip(torque) {
            residual.d += torque.d;
        }
        let torques = Torques {
            feedforward: &feedforward,
            residual: &x.residual,
        };
        eval.update_kinematics(models, &stance, &x.q, &x.v);
        eval.factor(models, stance.rows, None);
        eval.load(models, (&x.q, &x.v), now, torques);
        (eval.solution, _) = eval.factored.problem.regular(context.mode, slip);
        eval.back_substitute(models);
        for c in 0..n {
            exact[at][c] = eval.qdd[c].d;
        }
        for i in 0..3 {
            exact[at][NV + i] = eval.solution.f_root[i].d;
            exact[at][NV + 3 + i] = eval.solution.lam[i].d;
        }
    };
    for c in 0..n {
        if c > 0 {
            column(&|x| x.q[c].d = 1.0, position(c));
        }
        column(&|x| x.v[c].d = 1.0, velocity(n, c));
        if c >= ROOT {
            column(&|x| x.residual[c].d = 1.0, torque(n, c));
        }
    }
    let phase = start_of(state.controller.phase);
    let [feedforward, swing] = times(n);
    if phase == 0 {
        column(&|x| x.times[0].d = -1.0, feedforward);
        for row in 0..ROWS {
            found.columns[feedforward][row] += found.columns[swing][row];
            found.columns[swing][row] = 0.0;
        }
    } else {
        column(&|x| x.times[phase].d = -1.0, feedforward);
        column(&|x| x.times[0].d = -1.0, swing);
    }
    exact
}

/// Projection onto the free foot's constraints on dual numbers: positions, then velocities.
fn dual_projection(model: &Model, mode: ContactMode, x: &mut Variation<f64>) {
    if mode.free.touch == SoleContact::Air {
        return;
    }
    let (models, frictionless) = (Broadcast(model), Slip::default());
    let stance = Stance::of(models, mode);
    let mut eval = Box::<Evaluation<Dual<f64>>>::default();
    eval.update_kinematics(models, &stance, &x.q, &x.v);
    eval.factor(models, stance.rows, None);
    let constraints = PositionConstraints::of(mode.free, x.anchor);
    constraints.project(&mut eval, (models, &stance), &mut x.q, true, |problem| {
        problem.regular(mode, frictionless)
    });
    eval.update_kinematics(models, &stance, &x.q, &x.v);
    let (velocity, held) = (eval.point_velocity, constraints.held);
    let velocity = [0, 1, 2].map(|i| held[i] * velocity[i]);
    let problem = &mut eval.factored.problem;
    (problem.b, problem.alpha0) = (vec3::zero(), velocity.into());
    let (solution, _) = problem.regular(mode, frictionless);
    let step = *eval.response(models, &solution.a_root, &solution.lam);
    for c in 0..model.n {
        x.v[c] += step[c];
    }
}

/// Projections from 1e-7 beside the constraints have the derivatives of the same operations on dual numbers; the largest
/// difference is 9e-13.
#[test]
fn projections_have_the_derivatives_of_dual_numbers() {
    let mut rng = StdRng::seed_from_u64(2);
    let (mut worst, mut tried) = (0.0_f64, 0);
    for preset in [
        include_str!("../../../../../skate_env/studies/scenes/paper_damped.toml"),
        include_str!("../../../../../skate_env/scenes/push_only.toml"),
    ] {
        let scene = Scene::from_toml(preset).expect("a preset");
        let model = Model::compile(&scene).expect("a model");
        let varied = Varied {
            model: &model,
            parameters: &Parameters::default(),
        };
        let start = Simulation::new(model.clone()).expect("a start").state;
        for mode in model.modes() {
            let mut draw = |size: f64| rng.random_range(-size..size);
            let mut state = start;
            state.mode = mode;
            for c in 3..model.n {
                state.q[c] += draw(0.2);
                state.v[c] = draw(1.0);
            }
            let mut eval = Evaluation::default();
            let mut is_projected = false;
            for _ in 0..20 {
                eval.set_planar_configuration(&model, mode, &state.q, &state.v);
                eval.assemble(&model, mode.free.touch);
                is_projected = project(&model, &mut eval, &mut state) == Ok(false)
                    && violation(&eval, &state).0.amax() < 1e-11;
            }
            if !is_projected {
                continue;
            }
            for c in 3..model.n {
                state.q[c] += draw(1e-7);
                state.v[c] += draw(1e-7);
            }
            let mut x = Variation::<f64>::of(&state, &[0.0; NV]);
            for c in 0..model.n {
                (x.q[c].d, x.v[c].d) = (draw(1.0), draw(1.0));
            }
            x.anchor.d = draw(1.0);
            let (mut exact, mut found) = (x.clone(), x.clone());
            dual_projection(&model, mode, &mut exact);
            Box::<Differentiator<f64>>::default().project(varied, mode, &mut [&mut found]);
            if exact.v.iter().any(|v| !v.d.is_finite()) {
                continue;
            }
            worst = worst.max(difference(&derivatives(&found), &derivatives(&exact)));
            tried += 1;
        }
    }
    assert!(worst < 1e-11, "{worst:?}");
    assert!(tried > 25, "{tried}");
}

fn derivatives(x: &Variation<f64>) -> [f64; 2 * NV] {
    std::array::from_fn(|c| if c < NV { x.q[c].d } else { x.v[c - NV].d })
}

/// Largest difference, relative to the largest number.
fn difference(found: &[f64; 2 * NV], exact: &[f64; 2 * NV]) -> f64 {
    let size = exact.iter().fold(1.0_f64, |size, x| size.max(x.abs()));
    let differences = found.iter().zip(exact).map(|(a, b)| (a - b).abs());
    differences.fold(0.0, f64::max) / size
}
