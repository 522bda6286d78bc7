//! Projections and impacts against dual numbers.

use super::*;
use crate::{
    derivatives::dual::{Varied, resets::Reset},
    events::trace::Record,
    rhs::{Evaluation, projection::project},
    scene::Scene,
    sim::Simulation,
};
use rand::{Rng, SeedableRng, rngs::StdRng};

/// Projections from 1e-7 beside the constraints, and impacts, have the derivatives of the same operations on dual
/// numbers. The largest differences are 9e-13 and 9e-14.
#[test]
fn resets_have_the_derivatives_of_dual_numbers() {
    let mut rng = StdRng::seed_from_u64(2);
    let (mut worst, mut tried) = ([0.0_f64; 2], 0);
    for preset in [
        include_str!("../../../../../../skate_env/studies/scenes/paper_damped.toml"),
        include_str!("../../../../../../skate_env/scenes/push_only.toml"),
    ] {
        let scene = Scene::from_toml(preset).expect("a preset");
        let model = Model::compile(&scene).expect("a model");
        let mut state = Simulation::new(model.clone()).expect("a start").state;
        let start = state;
        for mode in model.modes() {
            let mut draw = |size: f64| rng.random_range(-size..size);
            state = start;
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
                is_projected = project(&model, &mut eval, &mut state) == Ok(false);
            }
            if !is_projected {
                continue;
            }
            for c in 3..model.n {
                state.q[c] += draw(1e-7);
                state.v[c] += draw(1e-7);
            }
            let mut varied = Variation::<f64>::of(&state, &[0.0; NV]);
            for c in 0..model.n {
                (varied.q[c].d, varied.v[c].d) = (draw(1.0), draw(1.0));
            }
            varied.anchor.d = draw(1.0);
            let records = [
                Record::Project(mode),
                Record::Impact {
                    mode,
                    has_friction: true,
                },
            ];
            for (worst, record) in worst.iter_mut().zip(&records) {
                let mut exact = varied.clone();
                let mut reset = Reset {
                    models: Varied::constant(&model),
                    eval: &mut Box::default(),
                    state: &mut exact,
                };
                reset.apply(record);
                let mut found = varied.clone();
                let mut shared = Box::<Differentiator<f64>>::default();
                match record {
                    Record::Project(_) => shared.project(&model, mode, &mut [&mut found]),
                    _ => shared.impact(&model, (mode, true), &mut [&mut found]),
                }
                if exact.v.iter().all(|v| v.d.is_finite()) {
                    *worst = worst.max(difference(&found, &exact));
                    tried += 1;
                }
            }
        }
    }
    assert!(worst[0] < 1e-11 && worst[1] < 1e-12, "{worst:?}");
    assert!(tried > 50, "{tried}");
}

/// Largest difference of the derivatives, relative to the largest one.
fn difference(found: &Variation<f64>, exact: &Variation<f64>) -> f64 {
    let all = |x: &Variation<f64>| x.q.iter().chain(&x.v).map(|x| x.d).collect::<Vec<_>>();
    let (found, exact) = (all(found), all(exact));
    let size = exact.iter().fold(1.0_f64, |size, x| size.max(x.abs()));
    let differences = found.iter().zip(&exact).map(|(a, b)| (a - b).abs());
    differences.fold(0.0, f64::max) / size
}
