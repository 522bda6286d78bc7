//! Derivatives of the accelerations and contact forces by the state.
//!
//! With the residual r = tau - inverse dynamics + J^T lam, and the acceleration a of the free foot's contact point,
//! both at constant accelerations and forces, the derivatives solve the equations of motion in the contact mode with
//! the loads dr and da: all columns share one factorisation.

use crate::{
    contact::equations::{Slip, Y},
    derivatives::{
        linear::{
            balance::{Balance, EQUATIONS, input_of},
            inputs::{self, COLUMNS},
            loads::Loads,
        },
        parameters::{Slopes, Varied},
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
    /// By every parameter of the scene.
    pub by_parameter: Slopes<ROWS>,
    /// Whether the contact constraints are independent.
    pub regular: bool,
}

impl Default for Jacobian {
    fn default() -> Self {
        Self {
            value: [0.0; ROWS],
            v: [0.0; NV],
            columns: [[0.0; ROWS]; COLUMNS],
            by_parameter: Slopes::default(),
            regular: true,
        }
    }
}

impl Jacobian {
    /// The state, whose positions are `q`, and the forces.
    pub fn balance<'a>(&'a self, mode: ContactMode, q: &'a [f64; NV]) -> Balance<'a> {
        let force = |at: usize| Vector3::from_column_slice(&self.value[at..at + 3]);
        Balance {
            mode,
            has_friction: true,
            q,
            v: &self.v,
            a: self.value.first_chunk().expect("ROWS > NV"),
            f_root: force(NV),
            lam: force(NV + 3),
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
    /// Evaluation of the models of other parameters.
    pub varied: Evaluation,
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
        Varied { model, parameters }: Varied<'_>,
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
        let balance = out.balance(context.mode, q);
        let by_parameter = parameters.slopes(|other| {
            let now = input_of(&context.now, model, other);
            balance.equations(other, &now, &mut self.varied)
        });
        let contact = (context.mode, context.slip);
        out.regular = self.solve(model, contact, &by_parameter, out) && done.is_ok();
    }

    /// Accelerations by the loads, column by column; false where the constraints depend on each other.
    #[inline(never)]
    fn solve(
        &mut self,
        model: &Model,
        contact: (ContactMode, Slip),
        by_parameter: &Slopes<EQUATIONS>,
        out: &mut Jacobian,
    ) -> bool {
        R::with_target_features(
            #[inline(always)]
            || {
                let n = model.n.min(NV);
                self.eval.factored.broadcast(model, &mut self.dynamics);
                let mut is_regular = true;
                let mut columns = [[0.0; ROWS]; MAX_LANES];
                for first in (0..inputs::columns(n)).step_by(R::LANES) {
                    let mut x = [R::zero(); NV];
                    for (x, row) in x[..n].iter_mut().zip(&self.loads.rows) {
                        *x = R::from_lanes(|lane| row[first + lane]);
                    }
                    let at = |row: &[f64; COLUMNS]| R::from_lanes(|lane| row[first + lane]);
                    let point = self.loads.point.each_ref().map(at);
                    let (rows, regular) = self.solve_loads(model, contact, x, point);
                    is_regular &= regular;
                    R::to_rows(&rows, &mut columns);
                    out.columns[first..first + R::LANES].copy_from_slice(&columns[..R::LANES]);
                }
                let all = &mut out.by_parameter.0;
                all.clear();
                for first in (0..by_parameter.0.len()).step_by(R::LANES) {
                    let loads = by_parameter.along::<R>(Some(first));
                    let loads = loads.unwrap_or([R::zero(); EQUATIONS]);
                    let x = *loads.first_chunk().expect("EQUATIONS > NV");
                    let (mut rows, regular) =
                        self.solve_loads(model, contact, x, [loads[NV], loads[NV + 1]]);
                    is_regular &= regular;
                    rows[NV + Y] += loads[NV + 2];
                    rows[NV + 3 + Y] += loads[NV + 3];
                    R::to_rows(&rows, &mut columns);
                    let lanes = R::LANES.min(by_parameter.0.len() - first);
                    all.extend_from_slice(&columns[..lanes]);
                }
                is_regular
            },
        )
    }

    /// Accelerations and contact forces by the loads `x` on the coordinates and the acceleration of the free foot's
    /// contact point, y and z; and whether the constraints are independent.
    #[inline(always)]
    fn solve_loads(
        &mut self,
        model: &Model,
        (mode, slip): (ContactMode, Slip),
        mut x: [R; NV],
        [y, z]: [R; 2],
    ) -> ([R; ROWS], bool) {
        let (n, models) = (model.n.min(NV), Broadcast(model));
        let dynamics = &mut self.dynamics;
        dynamics.tree.reduce_torques(models, &mut x);
        dynamics.set_loads(model, &x, Vector3::new(y, z, R::zero()));
        let problem = &dynamics.problem;
        let (solution, regular) = problem.regular(mode, slip.broadcast::<R>());
        let (root, lam) = (solution.a_root, solution.lam);
        dynamics.back_substitute(models, (&root, &lam), &mut x);
        let mut rows = [R::zero(); ROWS];
        rows[..n].copy_from_slice(&x[..n]);
        for i in 0..3 {
            (rows[NV + i], rows[NV + 3 + i]) = (solution.f_root[i], lam[i]);
        }
        (rows, regular.all())
    }
}
