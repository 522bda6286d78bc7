//! A scene without an effect moves like the full scene in which the effect does nothing, and never
//! needs more evaluations.
#![allow(non_snake_case)]

mod pairs;

use nalgebra::{DMatrix, DVector};
use pairs::{PAIRS, Pair, dry};
use rand::{Rng, SeedableRng, seq::IndexedRandom};
use rand_chacha::ChaCha8Rng;
use skate_core::{
    contact::{Foot, Grip, Mode, Touch},
    control::feedforward::Phase,
    evaluate::{Evaluation, Frozen},
    guards::{Guard, Guards},
    model::{Model, NV},
    packed::PackedMatrix,
    scene::{effects::EFFECTS, *},
    sim::Simulation,
    state::State,
};

/// A robot that glides on one leg under little weight and weak torques, so that a second may pass without
/// an event; posture, speeds and effects are drawn.
fn base(rng: &mut ChaCha8Rng) -> Scene {
    let mut scene = Scene::default();
    (scene.body.foot.toe, scene.body.foot.heel) = (0.3, 0.3);
    scene.ice.gravity = 0.1;
    scene.ice.friction = dry(0.02, 0.09);
    let mut on = |share: f64| rng.random_bool(share);
    scene.ledger = on(0.5);
    scene.body.joint_damping = on(0.8);
    scene.fall = on(0.5).then_some(Fall { head_height: -10.0 });
    scene.control.lifting = on(0.5).then_some(Lifting {
        K_p: [1.0, 0.5, 2.0],
        ahead: 0.1,
        height: 1.7,
    });
    scene.control.feedforward = on(0.5).then_some(Feedforward {
        scale: 0.002,
        tau7_scale: 0.02,
    });
    scene.control.arm_swing = on(0.5).then_some(ArmSwing { amplitude: 0.1 });
    scene.helpers.head_damping = on(0.5).then_some(HeadDamping { y: 1.0, z: 1.0 });
    scene.helpers.hip_pd = on(0.5).then_some(ProportionalDerivative::new(1.0, 1.0));
    scene.helpers.free_knee_pd = on(0.5).then_some(ProportionalDerivative::new(0.1, 0.1));
    let posture = [
        ("q2", 0.1),
        ("q3", -0.2),
        ("q4", 0.1),
        ("q5", 0.6),
        ("q6", -0.9),
        ("q7", 0.3),
    ];
    for name in &COORDINATES[3..] {
        let middle = posture.iter().find(|(joint, _)| joint == name);
        let q = middle.map_or(0.0, |(_, q)| *q) + rng.random_range(-0.03..0.03);
        scene.start.q.insert((*name).into(), q);
        scene
            .start
            .v
            .insert((*name).into(), rng.random_range(-0.02..0.02));
    }
    scene
        .start
        .v
        .insert("y0".into(), rng.random_range(1.0..2.0));
    scene
}

/// Both forms of a scene, or None where the pairs exclude each other.
fn both(base: &Scene, pairs: &[&Pair]) -> Option<[Scene; 2]> {
    let (mut without, mut with) = (base.clone(), base.clone());
    for pair in pairs {
        (pair.absent)(&mut without);
        (pair.inactive)(&mut with);
        for &joint in pair.joints {
            without.locked.push(joint.into());
            for scene in [&mut without, &mut with] {
                scene.start.q.remove(joint);
                scene.start.v.remove(joint);
                if joint == "q8" {
                    scene.control.arm_swing = None;
                }
            }
        }
    }
    let valid = without.validate().is_ok() && with.validate().is_ok();
    valid.then_some([without, with])
}

fn held(pairs: &[&Pair]) -> Vec<&'static str> {
    pairs.iter().flat_map(|pair| pair.joints).copied().collect()
}

/// Coordinates of `from` in the order of `to`; what `from` does not have is zero.
fn translate(from: &Model, to: &Model, x: &[f64; NV]) -> [f64; NV] {
    let mut out = [0.0; NV];
    for (i, name) in to.names.iter().enumerate() {
        out[i] = from.index(name).map_or(0.0, |j| x[j]);
    }
    out
}

/// Where dry friction is absent a sliding foot is loose; with a coefficient of zero it has a direction.
fn mode_in(model: &Model, mut mode: Mode) -> Mode {
    for foot in [&mut mode.support, &mut mode.free] {
        if foot.slides() && model.friction.is_dry() != foot.grip.rubs() {
            foot.grip = model.friction.grip(1.0, 0.0);
        }
    }
    mode
}

/// Evaluate with the torques on the joints of `held` that keep them from accelerating: what a lock does.
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
        let frozen = Frozen::of(model, state, tau);
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
    // The first solution is refined: what it leaves is rounding of large numbers.
    for _ in 0..3 {
        let left = DVector::from_iterator(held.len(), held.iter().map(|&c| -last.qdd[c]));
        let more = response.solve(&left)?;
        held.iter().zip(more.iter()).for_each(|(&c, x)| tau[c] += x);
        last = run(&tau)?;
    }
    Some(last)
}

/// Largest difference of two evaluations over the size of what is compared.
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
        if state.mode.free.touch != Touch::Air {
            all.extend(s.lam.iter());
        }
        all
    };
    apart(&a.1.qdd, &qdd).max(apart(&forces(a.1), &forces(b.1)))
}

/// A drawn state in a contact mode that both models know.
fn draw_state(rng: &mut ChaCha8Rng, model: &Model) -> State {
    let modes: Vec<Mode> = model.modes();
    let mut state = Simulation::new(model.clone()).expect("a start").state;
    for c in 3..model.n {
        state.q[c] = rng.random_range(-1.0..1.0);
        state.v[c] = rng.random_range(-5.0..5.0);
    }
    state.t = rng.random_range(0.0..2.0);
    state.mode = *modes.choose(rng).expect("some mode");
    let turns = state.mode.support.touch != Touch::Flat;
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
    state.v[0] = match state.mode.support.grip {
        Grip::Stuck => 0.0,
        Grip::Backward => -1.0,
        _ => 1.0,
    };
    state.clock.supported = true;
    state.clock.phase = *[
        None,
        Some(Phase::Swing),
        Some(Phase::Touched),
        Some(Phase::PushOff),
    ]
    .choose(rng)
    .expect("four");
    state
}

/// Largest difference per evaluation over drawn states and modes, guards included.
fn per_evaluation(rng: &mut ChaCha8Rng, [without, with]: &[Scene; 2], held: &[&str]) -> f64 {
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
        // A singular contact is singular in both.
        let Some((x, y)) = found else { continue };
        compared += 1;
        worst = worst.max(difference((&a, &x), (&b, &y), &state));
        let at = (0.1, state.v[0]);
        let watched = Guards::of(&b, other.mode);
        let own = Guards::of(&a, state.mode);
        let size = x.qdd.iter().fold(1.0, |top: f64, x| top.max(x.abs()));
        for guard in own.as_slice() {
            let known = watched.as_slice().contains(guard);
            // Push-only ice watches the ends' loads instead.
            let replaced = b.scene.contact.law != a.scene.contact.law;
            assert!(known || replaced, "{guard:?} is watched only without");
            // A foot that passes through the ice is no fall.
            if *guard == Guard::Fall && a.scene.contact.free_foot != b.scene.contact.free_foot {
                continue;
            }
            let value = |model, eval, mode| guard.value(model, eval, mode, at);
            let (g, h) = (value(&a, &x, state.mode), value(&b, &y, other.mode));
            worst = worst.max((g - h).abs() / size.max(g.abs()));
        }
    }
    assert!(compared > 0, "nothing to compare");
    worst
}

/// Largest difference after one second of steps of 0.5 ms.
fn after_a_second([without, with]: &[Scene; 2], held: &[&str]) -> f64 {
    let a = Model::compile(without).expect("valid");
    let b = Model::compile(with).expect("valid");
    if !held.is_empty() {
        return glide(&a, &b, held);
    }
    let coarse = |model: &Model| {
        let mut model = model.clone();
        model.scene.accuracy = Accuracy::Tolerance(1e-2);
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

/// The same for held joints, whose torque has to follow: the classical Runge-Kutta method.
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

/// Differences per evaluation and after a second; None where the pairs exclude each other.
fn compare(rng: &mut ChaCha8Rng, pairs: &[&Pair]) -> Option<(f64, f64)> {
    let held = held(pairs);
    let mut scenes = both(&base(rng), pairs)?;
    if held.is_empty() {
        let mut draws = 0;
        while !inactive_for_a_second(&scenes) {
            scenes = both(&base(rng), pairs)?;
            draws += 1;
            assert!(draws < 200, "no second without an event");
        }
    } else {
        // No guard ends this second; it may be livelier.
        for scene in &mut scenes {
            scene.start.v.values_mut().for_each(|v| *v *= 20.0);
        }
    }
    let once = per_evaluation(rng, &scenes, &held);
    Some((once, after_a_second(&scenes, &held)))
}

/// Does a second pass without an event, and without more evaluations where the effect is absent?
fn inactive_for_a_second(scenes: &[Scene; 2]) -> bool {
    let [fewer, more] = scenes.each_ref().map(|scene| {
        let mut sim = Simulation::new(Model::compile(scene).expect("valid")).expect("a start");
        sim.advance(1.0);
        sim
    });
    if fewer.ended.is_some() || more.ended.is_some() || more.stats.events > 0 {
        return false;
    }
    let [fewer, more] = [fewer, more].map(|sim| sim.stats.evaluations);
    assert!(fewer <= more, "{fewer} evaluations without, {more} with");
    true
}

#[test]
fn every_effect_has_its_pair() {
    let tested: Vec<_> = PAIRS.iter().map(|pair| pair.name).collect();
    let known: Vec<_> = EFFECTS.iter().map(|effect| effect.name).collect();
    assert_eq!(tested, known);
}

#[test]
fn an_absent_effect_equals_an_inactive_one() {
    let mut rng = ChaCha8Rng::seed_from_u64(11);
    let (mut once, mut second) = (0.0_f64, 0.0_f64);
    for pair in &PAIRS {
        for _ in 0..3 {
            let (x, y) = compare(&mut rng, &[pair]).expect("one effect can always be left out");
            println!("{:22} {x:.1e} per evaluation, {y:.1e} after 1 s", pair.name);
            (once, second) = (once.max(x), second.max(y));
        }
    }
    println!("worst {once:e} {second:e}");
    // Measured 6e-13 at most, where joints are held; otherwise 0 or nearly so.
    assert!(once < 1e-12, "{once:e}");
    // Measured 1e-14.
    assert!(second < 1e-10, "{second:e}");
}

#[test]
fn two_absent_effects_equal_two_inactive_ones() {
    let mut rng = ChaCha8Rng::seed_from_u64(12);
    let (mut once, mut second) = (0.0_f64, 0.0_f64);
    let mut done = 0;
    while done < 100 {
        let two: Vec<&Pair> = PAIRS.choose_multiple(&mut rng, 2).collect();
        let Some((x, y)) = compare(&mut rng, &two) else {
            continue;
        };
        done += 1;
        let names: Vec<_> = two.iter().map(|pair| pair.name).collect();
        println!("{names:?}: {x:.1e} per evaluation, {y:.1e} after 1 s");
        (once, second) = (once.max(x), second.max(y));
    }
    println!("worst {once:e} {second:e}");
    // Measured 6e-13 at most, where joints are held; otherwise 0 or nearly so.
    assert!(once < 1e-12, "{once:e}");
    // Measured 1e-14.
    assert!(second < 1e-10, "{second:e}");
}

/// Velocities that impulses on both feet cause, (supporting, free) x (y, z, rotation): what an impact
/// depends on. From M of all coordinates, those of `held` struck out.
fn response_of_the_whole(model: &Model, q: &[f64; NV], held: &[&str]) -> DMatrix<f64> {
    let free: Vec<usize> = (0..model.n)
        .filter(|&c| !held.contains(&model.names[c]))
        .collect();
    let mut eval = Evaluation::default();
    eval.survey(model, Touch::Toe, q, &[0.0; NV]);
    let mut M = PackedMatrix::default();
    eval.inertias.crba(model, &eval.kin, &mut M);
    let M = DMatrix::from_vec(model.n, model.n, M.dense(model));
    let M = M.select_rows(&free).select_columns(&free);
    let mut J = DMatrix::zeros(6, free.len());
    for (column, &c) in free.iter().enumerate() {
        let mut unit = [0.0; NV];
        unit[c] = 1.0;
        let mode = flat_feet();
        eval.move_planar(model, mode, q, &unit);
        for i in 0..3 {
            J[(i, column)] = if c == i { 1.0 } else { 0.0 };
            J[(3 + i, column)] = eval.point_velocity[i];
        }
    }
    &J * M
        .lu()
        .solve(&J.transpose())
        .expect("M is positive definite")
}

fn flat_feet() -> Mode {
    let foot = Foot::new(Touch::Flat, Grip::Forward);
    Mode {
        support: foot,
        free: foot,
    }
}

/// Merged joints are merged in impacts, too.
#[test]
fn impacts_know_of_no_merged_joint() {
    let mut rng = ChaCha8Rng::seed_from_u64(13);
    let whole = Model::compile(&Scene::default()).expect("valid");
    let mut worst: f64 = 0.0;
    for pair in PAIRS.iter().filter(|pair| !pair.joints.is_empty()) {
        let scene = Scene {
            locked: pair.joints.iter().map(|&joint| joint.into()).collect(),
            ..Scene::default()
        };
        let model = Model::compile(&scene).expect("valid");
        for _ in 0..20 {
            let q: [f64; NV] = std::array::from_fn(|_| rng.random_range(-1.0..1.0));
            let q = translate(&model, &model, &q);
            let mut eval = Evaluation::default();
            eval.move_to(&model, Touch::Toe, &q, &[0.0; NV]);
            eval.assemble(&model, Touch::Flat);
            let (S, G, W) = (eval.problem.S, eval.problem.G, eval.problem.W);
            let inverse = S.try_inverse().expect("S is positive definite");
            let cross = G * inverse;
            let own = cross * G.transpose() + W;
            let expected =
                response_of_the_whole(&whole, &translate(&model, &whole, &q), pair.joints);
            let size = expected.amax();
            for i in 0..3 {
                for j in 0..3 {
                    let apart = [
                        inverse[(i, j)] - expected[(i, j)],
                        cross[(i, j)] - expected[(3 + i, j)],
                        own[(i, j)] - expected[(3 + i, 3 + j)],
                    ];
                    worst = apart.iter().fold(worst, |top, x| top.max(x.abs() / size));
                }
            }
        }
    }
    // Measured 2e-12, the rounding of the dense solution.
    assert!(worst < 1e-11, "{worst:e}");
}
