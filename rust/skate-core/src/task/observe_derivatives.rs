//! Derivatives of an observation.

use crate::{
    derivatives::{Observed, observed, state_size},
    numeric::dual::Dual,
    sim::Simulation,
    task::{
        Task,
        observe::{SINCE_EVENT, write},
    },
};
use nalgebra::DMatrix;

/// Derivatives of an observation by the differentiated state, and in the last column by the time of the last change
/// of contact. Zero where an entry is clipped. `also` is called with every derivative of what they read.
pub(super) fn gradient(
    (sim, task): (&Simulation, &Task),
    standing: f64,
    mut also: impl FnMut(usize, &Observed<'_, Dual<f64>>),
) -> DMatrix<f64> {
    let (size, bounds) = (state_size(sim.model.n), &task.bounds);
    let mut rows = DMatrix::zeros(task.observation.len(), size + 1);
    let mut out = vec![Dual::default(); task.observation.len()];
    observed(sim, |i, seen| {
        also(i, seen);
        write(sim, standing, seen, (&mut out, |x| x));
        for (row, entry) in out.iter().enumerate() {
            if bounds.contain(row, entry.x) {
                rows[(row, i)] = entry.d;
            }
        }
    });
    let since_event = task.observation.iter().position(|e| e.name == SINCE_EVENT);
    if let Some(row) = since_event.filter(|&row| bounds.contain(row, sim.since_event())) {
        rows[(row, size)] = -1.0;
    }
    rows
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::{
        control::feedforward_torque,
        model::Model,
        rhs::sole_points::SolePoints,
        scene::Scene,
        sim::Coordinates,
        task::{Weights, reward::standing_height},
    };
    use std::sync::Arc;

    /// All entries before they are rounded and clipped.
    fn entries(sim: &Simulation, width: usize) -> Vec<f64> {
        let (torque, wave) = feedforward_torque(&sim.model, &sim.state);
        let seen = Observed {
            q: &sim.state.q,
            v: &sim.state.v,
            sole_points: &sim.sole_points,
            since_event: sim.since_event(),
            wave,
            torque: &torque,
        };
        let mut out = vec![0.0; width];
        write(sim, standing_height(&sim.model), &seen, (&mut out, |x| x));
        out
    }

    /// The simulation with entry `i` of its state changed; contact and constraints stay as they are.
    fn moved(sim: &Simulation, i: usize, dx: f64) -> Simulation {
        let (mut sim, n) = (sim.clone(), sim.model.n);
        let Coordinates { mut q, mut v } = sim.coordinates();
        match i {
            i if i < n => q[i] += dx,
            i if i < 2 * n => v[i - n] += dx,
            _ => {}
        }
        let at = sim.at_pivot(&q, &v);
        let state = &mut sim.state;
        (state.q, state.v) = (at.q, at.v);
        match i {
            i if i == 2 * n + 1 => state.controller.t0 += dx,
            i if i == 2 * n + 2 => state.controller.t1 += dx,
            i if i == 2 * n + 3 => state.controller.t2 += dx,
            _ => {}
        }
        let (q, v, mode) = (sim.state.q, sim.state.v, sim.state.mode);
        sim.eval.set_planar_configuration(&sim.model, mode, &q, &v);
        sim.sole_points = SolePoints::of_one(&sim.model, &sim.eval.kin, mode, q[1]);
        sim
    }

    /// Differences of order 6; largest error 2e-11.
    #[test]
    fn the_gradient_agrees_with_differences() {
        const H: f64 = 0.01;
        let mut worst: f64 = 0.0;
        for text in [
            include_str!("../../../../skate_env/scenes/paper_arms.toml"),
            include_str!("../../../../skate_env/scenes/push_only.toml"),
        ] {
            let scene = Scene::from_toml(text).expect("a scene");
            let joints = Model::compile(&scene).expect("a model").n - 3;
            let task = Task::new(scene, vec![1.0; joints], Weights::default()).expect("a task");
            let mut sim = Simulation::new(Arc::clone(&task.model)).expect("a simulation");
            for k in 1..12 {
                sim.advance(0.05 * f64::from(k));
                let rows = gradient((&sim, &task), standing_height(&sim.model), |_, _| {});
                for i in 0..state_size(sim.model.n) {
                    let width = task.observation.len();
                    let ends = [1.0, 2.0, 3.0].map(|k| {
                        let end = |dx: f64| entries(&moved(&sim, i, dx), width);
                        (end(k * H), end(-k * H))
                    });
                    for row in 0..width {
                        let [a, b, c] = ends.each_ref().map(|(more, less)| more[row] - less[row]);
                        let difference = (45.0 * a - 9.0 * b + c) / (60.0 * H);
                        worst = worst.max((rows[(row, i)] - difference).abs());
                    }
                }
            }
        }
        assert!(worst < 1e-9, "{worst}");
    }
}
