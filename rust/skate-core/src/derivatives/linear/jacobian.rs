//! Derivatives of the accelerations and contact forces by the state.
//!
//! With the residual r = tau - inverse dynamics + J^T lam, and the acceleration a of the free foot's contact point,
//! both at constant accelerations and forces, the derivatives solve the equations of motion in the contact mode with
//! the loads dr and da: all columns share one factorisation.

use crate::{
    contact::equations::Slip,
    derivatives::linear::{
        inputs::{COLUMNS, columns},
        loads::Loads,
    },
    dynamics::{delassus::FactoredDynamics, rnea_derivatives::RneaDerivatives},
    model::{
        Model,
        contact_mode::{ContactMode, SoleContact},
        lanes::Broadcast,
        layout::NV,
    },
    numeric::{
        scalar::{MAX_LANES, Mask},
        simd::Register,
    },
    rhs::{Evaluation, StepContext},
};
use nalgebra::Vector3;

/// Accelerations by coordinate, then the forces on the supporting and on the free foot.
pub const ROWS: usize = NV + 6;

/// Accelerations and contact forces with their derivatives.
#[derive(Debug, Clone)]
pub struct Jacobian {
    pub value: [f64; ROWS],
    /// Velocities.
    pub v: [f64; NV],
    /// Column by column, in the order of `inputs`.
    pub columns: [[f64; ROWS]; COLUMNS],
    /// Whether the contact constraints are independent.
    pub regular: bool,
}

impl Default for Jacobian {
    fn default() -> Self {
        Self {
            value: [0.0; ROWS],
            v: [0.0; NV],
            columns: [[0.0; ROWS]; COLUMNS],
            regular: true,
        }
    }
}

/// Workspace.
#[derive(Debug, Clone, Default)]
pub struct Differentiator<R: Register> {
    pub eval: Evaluation,
    /// The factorisation in every lane.
    pub dynamics: FactoredDynamics<R>,
    pub rnea: RneaDerivatives,
    loads: Loads,
}

/// The same numbers in every lane.
#[inline(always)]
pub fn broadcast<R: Register, const N: usize>(x: &[f64; N]) -> [R; N] {
    let mut lanes = [R::zero(); N];
    for (lane, x) in lanes.iter_mut().zip(x) {
        *lane = R::of(*x);
    }
    lanes
}

impl<R: Register> Differentiator<R> {
    /// Accelerations at (t, q, v) in the mode of `context` with their derivatives.
    pub fn update(
        &mut self,
        model: &Model,
        context: &StepContext,
        (t, q, v): (f64, &[f64; NV], &[f64; NV]),
        out: &mut Jacobian,
    ) {
        let mut context = *context;
        context.now.t = t;
        let eval = &mut self.eval;
        let done = eval.accelerations(model, q, v, &context);
        let solution = eval.solution;
        out.value[..NV].copy_from_slice(&eval.qdd);
        for i in 0..3 {
            (out.value[NV + i], out.value[NV + 3 + i]) = (solution.f_root[i], solution.lam[i]);
        }
        out.v = *v;
        eval.kin.limbs(model);
        eval.inertias.update(model, &eval.kin);
        let has_contact = context.mode.free.touch != SoleContact::Air;
        let contact = has_contact.then_some(&solution);
        let known = (&*eval, &mut self.rnea);
        self.loads
            .update(model, known, (q, v, &eval.qdd), &context.now, contact);
        out.regular = self.solve(model, (context.mode, context.slip), out) && done.is_ok();
    }

    /// Accelerations by the loads, column by column; false where the constraints depend on each other.
    #[inline(never)]
    fn solve(
        &mut self,
        model: &Model,
        (mode, slip): (ContactMode, Slip),
        out: &mut Jacobian,
    ) -> bool {
        R::with_target_features(
            #[inline(always)]
            || {
                let (n, models) = (model.n.min(NV), Broadcast(model));
                let slip = slip.broadcast::<R>();
                let dynamics = &mut self.dynamics;
                self.eval.factored.broadcast(model, dynamics);
                let mut is_regular = true;
                for first in (0..columns(n)).step_by(R::LANES) {
                    let mut x = [R::zero(); NV];
                    let mut rows = [R::zero(); ROWS];
                    for (x, row) in x[..n].iter_mut().zip(&self.loads.rows) {
                        *x = R::from_lanes(|lane| row[first + lane]);
                    }
                    let point = &self.loads.point;
                    let y = R::from_lanes(|lane| point[0][first + lane]);
                    let z = R::from_lanes(|lane| point[1][first + lane]);
                    dynamics.tree.reduce_torques(models, &mut x);
                    dynamics.set_loads(model, &x, Vector3::new(y, z, R::zero()));
                    let (solution, regular) = dynamics.problem.regular_compact(mode, slip);
                    is_regular &= regular.all();
                    let (root, lam) = (solution.a_root, solution.lam);
                    dynamics.back_substitute(models, (&root, &lam), &mut x);
                    rows[..n].copy_from_slice(&x[..n]);
                    for i in 0..3 {
                        (rows[NV + i], rows[NV + 3 + i]) = (solution.f_root[i], lam[i]);
                    }
                    let mut columns = [[0.0; ROWS]; MAX_LANES];
                    R::to_rows(&rows, &mut columns);
                    out.columns[first..first + R::LANES].copy_from_slice(&columns[..R::LANES]);
                }
                is_regular
            },
        )
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::{
        control::feedforward::start_of,
        derivatives::{
            dual::{
                Varied,
                flow::{Context, accelerations},
            },
            linear::inputs::{position, times, torque, velocity},
            variation::Variation,
        },
        model::{
            controller_state::{ControllerState, Phase},
            layout::ROOT,
            state::State,
        },
        numeric::dual::Dual,
        scene::{HeadDamping, KneeStop, Leg, ProportionalDerivative, Scene, Stabilizers},
        sim::Simulation,
    };
    use rand::{Rng, SeedableRng, rngs::StdRng};

    /// Every column equals the derivative on dual numbers, in every mode and with every term of the controller.
    /// The largest difference is 1.1e-10, with almost dependent constraints.
    #[test]
    fn columns_are_those_of_dual_numbers() {
        let presets = [
            include_str!("../../../../../skate_env/scenes/paper.toml"),
            include_str!("../../../../../skate_env/scenes/paper_arms.toml"),
            include_str!("../../../../../skate_env/scenes/push_only.toml"),
            include_str!("../../../../../skate_env/studies/scenes/blade.toml"),
        ];
        let mut rng = StdRng::seed_from_u64(1);
        let (mut worst, mut tried) = (0.0_f64, 0);
        for preset in presets {
            let mut scene = Scene::from_toml(preset).expect("a preset");
            scene.stabilizers = Stabilizers {
                head_damping: Some(HeadDamping { y: 30.0, z: 7.0 }),
                hip_pd: Some(ProportionalDerivative::new(50.0, 3.0)),
                free_knee_pd: Some(ProportionalDerivative::new(20.0, 2.0)),
                knee_stop: Some(KneeStop {
                    stiffness: 300.0,
                    damping: 0.4,
                }),
            };
            let model = Model::compile(&scene).expect("a model");
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
                    if let Some(error) = error(&model, &state, &residual) {
                        worst = worst.max(error);
                        tried += 1;
                    }
                }
            }
        }
        assert!(worst < 5e-10, "{worst:e}");
        assert!(tried > 50, "{tried}");
    }

    /// Largest difference, relative to the largest entry of its row; None for dependent constraints.
    fn error(model: &Model, state: &State, residual: &[f64; NV]) -> Option<f64> {
        let context = StepContext::of(model, state, residual);
        let mut found = Jacobian::default();
        let mut differentiator = Differentiator::<f64>::default();
        differentiator.update(model, &context, (state.t, &state.q, &state.v), &mut found);
        if !found.regular {
            return None;
        }
        let n = model.n;
        let phase = start_of(state.controller.phase);
        let mut exact = [[0.0; ROWS]; COLUMNS];
        let mut eval = Box::<Evaluation<Dual<f64>>>::default();
        let mut column = |vary: &dyn Fn(&mut Variation<f64>), at: usize| {
            let mut variation = Variation::<f64>::of(state, residual);
            vary(&mut variation);
            let dual = Context::of(&context, &variation);
            let Variation { t, q, v, .. } = variation;
            accelerations(&mut eval, Varied::constant(model), &dual, t, (&q, &v));
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
        let [feedforward, swing] = times(n);
        if phase == 0 {
            // Both count from the leg swap.
            column(&|x| x.times[0].d = -1.0, feedforward);
            for row in 0..ROWS {
                found.columns[feedforward][row] += found.columns[swing][row];
                found.columns[swing][row] = 0.0;
            }
        } else {
            column(&|x| x.times[phase].d = -1.0, feedforward);
            column(&|x| x.times[0].d = -1.0, swing);
        }
        let mut worst: f64 = 0.0;
        for row in 0..ROWS {
            // The forces have one scale.
            let rows = if row < NV { row..row + 1 } else { NV..ROWS };
            let all = exact.iter().flat_map(|column| &column[rows.clone()]);
            let size = all.fold(1.0_f64, |size, x| size.max(x.abs()));
            for (found, exact) in found.columns.iter().zip(&exact) {
                worst = worst.max((found[row] - exact[row]).abs() / size);
            }
        }
        Some(worst)
    }
}
