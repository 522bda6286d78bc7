//! Derivatives of projections, which end every time step on constraints. All directions share one factorisation, as in
//! `jacobian`.
//!
//! Changes s of positions and velocities by a projection obey M s = f_r + J^T lam. At constant s and lam the residual of this equation depends on q and parameters only, as
//! inverse dynamics of the accelerations s do at rest without gravity.

use crate::{
    contact::equations::{Slip, Y, Z},
    derivatives::{
        linear::{
            balance::{Balance, sole_point},
            jacobian::{Differentiator, broadcast},
            loads::Chain,
            point::Point,
        },
        parameters::{Slopes, Varied},
        variation::Variation,
    },
    model::{
        Model,
        contact_mode::{ContactMode, Foot, SoleContact},
        friction::FrictionMode,
        lanes::Broadcast,
        layout::{LEG, NV},
    },
    numeric::{dual::Dual, simd::Register, trig::nearest_half_turn},
    rhs::{Evaluation, Stance, ankle_to_point, projection::PositionConstraints},
};
use nalgebra::Vector3;

/// Changes of positions [m, rad] and velocities [m/s, rad/s] that count as none: their effect on the derivatives is of
/// that size.
const NONE: f64 = 1e-11;

/// Derivatives of what changes the state, for constant changes and forces.
struct Residual {
    by_q: Box<[[f64; NV]; NV]>,
    by_parameter: Slopes<NV>,
}

/// A projection: the contact point after the correction of the positions, and, where the velocities change, at that
/// change. The residuals are None where nothing changes.
struct Projection {
    mode: ContactMode,
    point: Point,
    positions: Option<Residual>,
    velocities: Option<Residual>,
    change: Point,
    /// Changes of positions and velocities.
    moved: [f64; NV],
    step: [f64; NV],
}

impl Residual {
    /// Products with the variation of positions and parameters.
    #[inline(always)]
    fn loads<R: Register>(&self, n: usize, x: &Variation<R>) -> [R; NV] {
        let explicit = self.by_parameter.along(x.parameter);
        let mut loads = explicit.unwrap_or([R::zero(); NV]);
        for (load, row) in loads[..n].iter_mut().zip(&*self.by_q) {
            for c in 2..n {
                *load += R::of(row[c]) * x.q[c].d;
            }
        }
        loads
    }
}

impl<R: Register> Differentiator<R> {
    /// Kinematics and the factor of M in the frame of `mode`.
    #[inline(never)]
    fn factor_at(&mut self, model: &Model, mode: ContactMode, (q, v): (&[f64; NV], &[f64; NV])) {
        self.eval.set_planar_configuration(model, mode, q, v);
        self.eval.assemble(model, mode.free.touch);
        R::with_target_features(
            #[inline(always)]
            || self.eval.factored.broadcast(model, &mut self.dynamics),
        );
    }

    /// The free foot's contact point at the present positions and the velocities `v`.
    fn point(
        &mut self,
        Varied { model, parameters }: Varied<'_>,
        mode: ContactMode,
        (q, v): (&[f64; NV], &[f64; NV]),
    ) -> Point {
        let touch = mode.free.touch;
        if touch == SoleContact::Air {
            return Point::default();
        }
        let by_parameter = parameters.slopes(|other| {
            let along = ankle_to_point(other, touch);
            sole_point(other, &mut self.varied, (mode, along), (q, v))
        });
        let Evaluation { kin, point, .. } = &mut self.eval;
        kin.planar_velocities(model, v);
        Point::of(kin, *point, by_parameter)
    }

    /// See `Residual`. The free foot's contact point is that of `chain`, and the f64 kinematics are those of the factor.
    fn residual(&mut self, varied: Varied<'_>, chain: &Chain, balance: &Balance<'_>) -> Residual {
        let bodies = (&self.eval.kin, &self.eval.inertias);
        let motion = (&[0.0; NV], balance.a, 0.0);
        self.rnea.update(varied.model, bodies, motion);
        let mut by_q = Box::new(self.rnea.by_q.map(|row| row.map(|x| -x)));
        let force = [balance.lam[Y], balance.lam[Z]];
        if force != [0.0; 2] {
            for c in 2..LEG {
                let change = chain.torque_change(c, force);
                for j in 2..c {
                    by_q[j][c] -= change;
                    by_q[c][j] -= change;
                }
                by_q[c][c] -= change;
            }
        }
        let parameters = varied.parameters;
        let by_parameter =
            parameters.slopes(|other| balance.forces_at_rest(other, &mut self.varied));
        Residual { by_q, by_parameter }
    }

    /// Motion of all coordinates that removes a violation of the free foot's constraints, with further loads, and the
    /// multipliers.
    #[inline(never)]
    fn correction(
        &mut self,
        model: &Model,
        mode: ContactMode,
        (loads, violation): (Option<&[R; NV]>, Vector3<R>),
    ) -> ([R; NV], Vector3<R>) {
        R::with_target_features(
            #[inline(always)]
            || {
                let models = Broadcast(model);
                let dynamics = &mut self.dynamics;
                let mut x = [R::zero(); NV];
                if let Some(loads) = loads {
                    x = *loads;
                    dynamics.tree.reduce_torques(models, &mut x);
                }
                dynamics.set_loads(model, &x, violation);
                let (solution, _) = dynamics.problem.regular(mode, Slip::default());
                let motion = (&solution.a_root, &solution.lam);
                dynamics.back_substitute(models, motion, &mut x);
                (x, solution.lam)
            },
        )
    }

    /// Projection onto the free foot's constraints: positions, then velocities.
    pub fn project(
        &mut self,
        varied: Varied<'_>,
        mode: ContactMode,
        states: &mut [&mut Variation<R>],
    ) {
        if mode.free.touch != SoleContact::Air
            && let Some(first) = states.first()
        {
            let projection = self.projection(varied, mode, first);
            let model = varied.model;
            R::with_target_features(
                #[inline(always)]
                || {
                    for x in states {
                        let q = x.q;
                        let residual = projection.velocities.as_ref();
                        let loads = residual.map(|residual| residual.loads(model.n, x));
                        self.project_positions(model, &projection, x);
                        let mut velocity = projection.point.velocity(x);
                        let change = &projection.change;
                        change.add_turning(&q, x.parameter, &mut velocity);
                        let (step, _) = self.correction(model, mode, (loads.as_ref(), velocity));
                        for c in 0..model.n {
                            x.v[c].d += step[c];
                            x.v[c].x += projection.step[c];
                        }
                    }
                },
            );
        }
    }

    /// The closed ends move onto the ice.
    pub fn close_gaps(
        &mut self,
        varied: Varied<'_>,
        (closed, projects): (ContactMode, bool),
        states: &mut [&mut Variation<R>],
    ) {
        for x in states.iter_mut() {
            if closed.support.touch != SoleContact::Air {
                x.q[1] = Dual::default();
                if closed.support.touch == SoleContact::Flat {
                    x.q[2] = nearest_half_turn(x.q[2]);
                }
            }
        }
        let slide = |foot: Foot| Foot::new(foot.touch, FrictionMode::Forward);
        let mode = ContactMode {
            support: slide(closed.support),
            free: slide(closed.free),
        };
        if projects && let Some(first) = states.first() {
            let projection = self.projection(varied, mode, first);
            R::with_target_features(
                #[inline(always)]
                || {
                    for x in states {
                        self.project_positions(varied.model, &projection, x);
                    }
                },
            );
        }
    }

    /// The projection from a state.
    fn projection(
        &mut self,
        varied: Varied<'_>,
        mode: ContactMode,
        x: &Variation<R>,
    ) -> Projection {
        let model = varied.model;
        let (q, v) = (x.q.map(|q| q.x), x.v.map(|v| v.x));
        self.factor_at(model, mode, (&q, &v));
        let before = self.point(varied, mode, (&q, &v));
        let (moved, lam) = self.close(model, mode, (&q, x.anchor.x));
        let mut closed = q;
        for (closed, moved) in closed.iter_mut().zip(&moved) {
            *closed += moved;
        }
        self.eval.set_velocities(model, mode, &v);
        let velocity = Vector3::from(broadcast(&self.eval.point_velocity));
        let (step, impulse) = self.correction(model, mode, (None, velocity));
        let (step, impulse) = (step.map(|x| x.lane(0)), impulse.map(|x| x.lane(0)));
        let point = self.point(varied, mode, (&closed, &v));
        let change = self.point(varied, mode, (&q, &step));
        let mut residuals = [None, None];
        let mut is_updated = false;
        let changes = [(&moved, lam), (&step, impulse)];
        for (residual, (a, lam)) in residuals.iter_mut().zip(changes) {
            if a.iter().all(|x| x.abs() < NONE) {
                continue;
            }
            if !is_updated {
                self.eval.full_kinematics(model, mode.support.touch, &q, &v);
                is_updated = true;
            }
            let balance = Balance {
                mode,
                has_friction: false,
                q: &q,
                v: &v,
                a,
                f_root: Vector3::zeros(),
                lam,
            };
            *residual = Some(self.residual(varied, &before.chain, &balance));
        }
        let [positions, velocities] = residuals;
        Projection {
            mode,
            point,
            positions,
            velocities,
            change,
            moved,
            step,
        }
    }

    /// Move the free foot onto its constraints. Returns the change of the positions and the sum of the multipliers.
    fn close(
        &mut self,
        model: &Model,
        mode: ContactMode,
        (q, anchor): (&[f64; NV], f64),
    ) -> ([f64; NV], Vector3<f64>) {
        let constraints = PositionConstraints::of(mode.free, anchor);
        let (mut change, mut sum) = (*q, Vector3::zeros());
        let moved = constraints.project(
            &mut self.eval,
            (model, &Stance::of(model, mode)),
            &mut change,
            true,
            |problem| {
                let solution = problem.solve(mode, Slip::default()).unwrap_or_default();
                sum += solution.lam;
                (solution, true)
            },
        );
        for (change, q) in change.iter_mut().zip(q) {
            *change -= q;
        }
        // Corrections that are taken back have no multipliers.
        (change, if moved { sum } else { Vector3::zeros() })
    }

    #[inline(always)]
    fn project_positions(&mut self, model: &Model, projection: &Projection, x: &mut Variation<R>) {
        let mode = projection.mode;
        // The factor belongs to the positions before the projection. Each further correction leaves about the change of
        // the positions of what the one before has left.
        let residual = projection.positions.as_ref();
        let mut loads = residual.map(|residual| residual.loads(model.n, x));
        let largest = projection
            .moved
            .iter()
            .fold(0.0_f64, |all, x| all.max(x.abs()));
        let corrections = match largest {
            0.0..NONE => 1,
            NONE..1e-6 => 2,
            _ => 6,
        };
        for _ in 0..corrections {
            let mut violation = projection.point.position(x);
            violation[Y] -= x.anchor.d;
            let (step, _) = self.correction(model, mode, (loads.as_ref(), violation));
            for c in 0..model.n {
                x.q[c].d += step[c];
            }
            loads = None;
        }
        for c in 0..model.n {
            x.q[c].x += projection.moved[c];
        }
    }
}
