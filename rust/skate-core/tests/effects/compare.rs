//! Comparison of two scenes: per evaluation, and after one second.

use nalgebra::{DMatrix, DVector};
use rand::{Rng, seq::IndexedRandom};
use rand_chacha::ChaCha8Rng;
use skate_core::{
    events::{guard::Guard, guards::Guards},
    model::{
        Model,
        contact_mode::{ContactMode, SoleContact},
        controller_state::Phase,
        friction::FrictionMode,
        layout::NV,
        state::State,
    },
    rhs::{Evaluation, StepContext},
    scene::{Accuracy, Scene},
    sim::Simulation,
};

/// Map coordinates of `from` to those of `to`; missing ones are zero.
pub fn translate(from: &Model, to: &Model, x: &[f64; NV]) -> [f64; NV] {
    let mut out = [0.0; NV];
    for (i, name) in to.names.iter().enumerate() {
        out[i] = from.index(name).map_or(0.0, |j| x[j]);
    }
    out
}

/// Without dry friction a sliding foot is frictionless; with a coefficient of zero it has a sliding
/// direction.
fn mode_in(model: &Model, mut mode: ContactMode) -> ContactMode {
    for foot in [&mut mode.support, &mut mode.free] {
        if foot.slides() && model.friction.is_dry() != foot.friction_mode.has_dry_friction() {
            foot.friction_mode = model.friction.mode_at(1.0, 0.0);
        }
    }
    mode
}

/// Evaluate with the torques on the joints of `held` that keep them from accelerating, which is equivalent
/// to locking.
fn evaluate(
    model: &Model,
    state: &State,
    residual: &[f64; NV],
    held: &[&str],
) -> Option<Evaluation> {
    let held: Vec<usize> = held.iter().filter_map(|name| model.index(name)).collect();
    let (q, v) = (state.q, state.v);
    let mut tau = *residual;
    let mut eval = Evaluation::default();
    let mut run = |tau: &[f64; NV]| -> Option<Evaluation> {
        let frozen = StepContext::of(model, state, tau);
        eval.accelerations(model, &q, &v, &frozen).ok()?;
        Some(eval.clone())
    };
    if held.is_empty() {
        return run(&tau);
    }
    let free = run(&tau)?;
    let mut response = DMatrix::zeros(held.len(), held.len());
    for (j, &c) in held.iter().enumerate() {
        let mut pushed = tau;
        pushed[c] += 1.0;
        let pushed = run(&pushed)?;
        for (i, &r) in held.iter().enumerate() {
            response[(i, j)] = pushed.qdd[r] - free.qdd[r];
        }
    }
    let response = response.lu();
    let mut last = free;
    // Iterative refinement of the first solution, which has the rounding error of large numbers.
    for _ in 0..3 {
        let left = DVector::from_iterator(held.len(), held.iter().map(|&c| -last.qdd[c]));
        let more = response.solve(&left)?;
        held.iter().zip(more.iter()).for_each(|(&c, x)| tau[c] += x);
        last = run(&tau)?;
    }
    Some(last)
}

/// Largest difference of two evaluations, relative to the size of the compared values.
fn difference(a: (&Model, &Evaluation), b: (&Model, &Evaluation), state: &State) -> f64 {
    let size = |x: &[f64]| x.iter().fold(1.0, |top: f64, x| top.max(x.abs()));
    let apart = |x: &[f64], y: &[f64]| {
        let pairs = x.iter().zip(y).map(|(x, y)| (x - y).abs());
        pairs.fold(0.0, f64::max) / size(x).max(size(y))
    };
    let qdd = translate(b.0, a.0, &b.1.qdd);
    let forces = |e: &Evaluation| {
        let s = &e.solution;
        let mut all = vec![s.f_root[0], s.f_root[1], s.f_root[2]];
        if state.mode.free.touch != SoleContact::Air {
            all.extend(s.lam.iter());
        }
        all
    };
    apart(&a.1.qdd, &qdd).max(apart(&forces(a.1), &forces(b.1)))
}

/// A random state in a contact mode of both models.
fn draw_state(rng: &mut ChaCha8Rng, model: &Model) -> State {
    let modes: Vec<ContactMode> = model.modes();
    let mut state = Simulation::new(model.clone()).expect("a start").state;
    for c in 3..model.n {
        state.q[c] = rng.random_range(-1.0..1.0);
        state.v[c] = rng.random_range(-5.0..5.0);
    }
    state.t = rng.random_range(0.0..2.0);
    state.mode = *modes.choose(rng).expect("some mode");
    let turns = state.mode.support.touch != SoleContact::Flat;
    state.q[2] = if turns {
        rng.random_range(-0.5..0.5)
    } else {
        0.0
    };
    state.v[2] = if turns {
        rng.random_range(-1.0..1.0)
    } else {
        0.0
    };
    state.v[0] = match state.mode.support.friction_mode {
        FrictionMode::Stuck => 0.0,
        FrictionMode::Backward => -1.0,
        _ => 1.0,
    };
    state.controller.supported = true;
    state.controller.phase = *[
        None,
        Some(Phase::Swing),
        Some(Phase::Touched),
        Some(Phase::PushOff),
    ]
    .choose(rng)
    .expect("four");
    state
}

/// Largest difference per evaluation over random states and modes, including guards.
pub fn per_evaluation(rng: &mut ChaCha8Rng, [without, with]: &[Scene; 2], held: &[&str]) -> f64 {
    let a = Model::compile(without).expect("valid");
    let b = Model::compile(with).expect("valid");
    let mut worst: f64 = 0.0;
    let mut compared = 0;
    for _ in 0..30 {
        let state = draw_state(rng, &a);
        let mut other = state;
        other.mode = mode_in(&b, state.mode);
        if !b.modes().contains(&other.mode) {
            continue;
        }
        (other.q, other.v) = (translate(&a, &b, &state.q), translate(&a, &b, &state.v));
        let residual = translate(
            &a,
            &a,
            &std::array::from_fn(|_| rng.random_range(-5.0..5.0)),
        );
        let there = translate(&a, &b, &residual);
        let found = evaluate(&a, &state, &residual, &[]).zip(evaluate(&b, &other, &there, held));
        // A contact problem that is singular in one scene is singular in the other.
        let Some((x, y)) = found else { continue };
        compared += 1;
        worst = worst.max(difference((&a, &x), (&b, &y), &state));
        let at = (0.1, state.v[0]);
        let watched = Guards::of(&b, other.mode);
        let own = Guards::of(&a, state.mode);
        let size = x.qdd.iter().fold(1.0, |top: f64, x| top.max(x.abs()));
        for guard in own.as_slice() {
            let known = watched.as_slice().contains(guard);
            // Push-only contact has load guards at the ends instead.
            let replaced = b.scene.contact.law != a.scene.contact.law;
            assert!(known || replaced, "{guard:?} is watched only without");
            // A foot below the ice does not count as a fall.
            if *guard == Guard::Fall && a.scene.contact.free_foot != b.scene.contact.free_foot {
                continue;
            }
            let value = |model: &Model, eval, mode| guard.value(model, eval, mode, at);
            let (g, h) = (value(&a, &x, state.mode), value(&b, &y, other.mode));
            worst = worst.max((g - h).abs() / size.max(g.abs()));
        }
    }
    assert!(compared > 0, "nothing to compare");
    worst
}

/// Largest difference after one second with time steps of 0.5 ms.
pub fn after_a_second([without, with]: &[Scene; 2], held: &[&str]) -> f64 {
    let a = Model::compile(without).expect("valid");
    let b = Model::compile(with).expect("valid");
    if !held.is_empty() {
        return glide(&a, &b, held);
    }
    let coarse = |model: &Model| {
        let mut model = model.clone();
        model.scheme = Accuracy::Tolerance(1e-2).into();
        let mut sim = Simulation::new(model).expect("a start");
        for i in 1..=2000 {
            sim.advance(f64::from(i) * 5e-4);
        }
        assert_eq!(sim.ended, None);
        assert_eq!(sim.state.t, 1.0);
        sim.state
    };
    let (x, y) = (coarse(&a), coarse(&b));
    let apart = |x: &[f64; NV], y: &[f64; NV]| {
        x.iter()
            .zip(y)
            .map(|(x, y)| (x - y).abs())
            .fold(0.0, f64::max)
    };
    assert_eq!(x.mode.number(), y.mode.number());
    apart(&x.q, &translate(&b, &a, &y.q)).max(apart(&x.v, &translate(&b, &a, &y.v)))
}

/// The same for held joints, whose torques are recomputed at every stage: the classical Runge-Kutta method.
fn glide(a: &Model, b: &Model, held: &[&str]) -> f64 {
    let first = Simulation::new(a.clone()).expect("a start").state.mode;
    let run = |model: &Model, held: &[&str]| {
        let mut state = Simulation::new(model.clone()).expect("a start").state;
        state.mode = mode_in(model, first);
        let h = 1e-3;
        for i in 0..1000 {
            let t = f64::from(i) * h;
            let slope = |q: &[f64; NV], v: &[f64; NV], t: f64| {
                let mut at = state;
                (at.q, at.v, at.t) = (*q, *v, t);
                let eval = evaluate(model, &at, &[0.0; NV], held).expect("regular");
                (*v, eval.qdd)
            };
            let add = |x: &[f64; NV], h: f64, k: &[f64; NV]| -> [f64; NV] {
                std::array::from_fn(|c| x[c] + h * k[c])
            };
            let (q, v) = (state.q, state.v);
            let k1 = slope(&q, &v, t);
            let k2 = slope(
                &add(&q, h / 2.0, &k1.0),
                &add(&v, h / 2.0, &k1.1),
                t + h / 2.0,
            );
            let k3 = slope(
                &add(&q, h / 2.0, &k2.0),
                &add(&v, h / 2.0, &k2.1),
                t + h / 2.0,
            );
            let k4 = slope(&add(&q, h, &k3.0), &add(&v, h, &k3.1), t + h);
            for c in 0..model.n {
                state.q[c] += h / 6.0 * (k1.0[c] + 2.0 * (k2.0[c] + k3.0[c]) + k4.0[c]);
                state.v[c] += h / 6.0 * (k1.1[c] + 2.0 * (k2.1[c] + k3.1[c]) + k4.1[c]);
            }
        }
        state
    };
    let (x, y) = (run(a, &[]), run(b, held));
    let mut worst: f64 = 0.0;
    for (c, name) in b.names.iter().enumerate() {
        let (q, v) = a.index(name).map_or((0.0, 0.0), |i| (x.q[i], x.v[i]));
        worst = worst.max((q - y.q[c]).abs()).max((v - y.v[c]).abs());
    }
    worst
}
