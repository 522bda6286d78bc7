//! Derivatives of projections and impacts, for constant parameters of the scene. All directions share one
//! factorisation, as in `jacobian`.
//!
//! Changes s of the velocities by an impact, and of positions and velocities by a projection, obey
//! M s = f_r + J^T lam. At constant s and lam the residual of this equation depends on q only, as inverse dynamics of
//! the accelerations s do at rest without gravity.

use crate::{
    contact::equations::{Slip, Y},
    derivatives::{
        linear::{
            frame_changes::Point,
            jacobian::{Differentiator, broadcast},
            loads::Chain,
        },
        variation::{Variation, held},
    },
    model::{
        Model,
        contact_mode::{ContactMode, Foot, SoleContact},
        friction::FrictionMode,
        lanes::Broadcast,
        layout::{LEG, NV},
    },
    numeric::{dual::Dual, scalar::Scalar, simd::Register, vec3},
    rhs::{Evaluation, Stance, projection::PositionConstraints},
};
use nalgebra::Vector3;

/// Changes of positions [m, rad] and velocities [m/s, rad/s] that count as none: their effect on the derivatives is of
/// that size.
const NONE: f64 = 1e-11;

/// Derivative by the positions of what changes the state, for constant changes and forces; None where nothing
/// changes.
type Residual = Option<Box<[[f64; NV]; NV]>>;

/// A projection: the contact point after the correction of the positions, and, where the velocities change, at that
/// change.
struct Projection {
    mode: ContactMode,
    point: Point,
    positions: Residual,
    velocities: Residual,
    change: Point,
    /// Changes of positions and velocities.
    moved: [f64; NV],
    step: [f64; NV],
}

/// An impact: velocities after it, and the derivative of the residual by the positions.
struct Impact {
    mode: ContactMode,
    slip: Slip,
    point: Point,
    after: [f64; NV],
    residual: Residual,
}

/// Products of a residual and the variation of the positions.
#[inline(always)]
fn loads<R: Scalar>(n: usize, residual: &Residual, q: &[Dual<R>; NV]) -> Option<[R; NV]> {
    let residual = residual.as_ref()?;
    let mut loads = [R::zero(); NV];
    for (load, row) in loads[..n].iter_mut().zip(&**residual) {
        for c in 2..n {
            *load += R::of(row[c]) * q[c].d;
        }
    }
    Some(loads)
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
    fn point(&mut self, model: &Model, mode: ContactMode, v: &[f64; NV]) -> Point {
        if mode.free.touch == SoleContact::Air {
            return Point::default();
        }
        let Evaluation { kin, point, .. } = &mut self.eval;
        kin.planar_velocities(model, v);
        Point::of(kin, *point)
    }

    /// See `Residual`; `lam` is the force on the free foot, whose contact point is that of `chain`. The f64 kinematics
    /// are those of the factor.
    fn residual(
        &mut self,
        model: &Model,
        chain: &Chain,
        change: &[f64; NV],
        lam: [f64; 2],
    ) -> Residual {
        let bodies = (&self.eval.kin, &self.eval.inertias);
        self.rnea.update(model, bodies, (&[0.0; NV], change, 0.0));
        let mut residual = Box::new(self.rnea.by_q.map(|row| row.map(|x| -x)));
        if lam != [0.0; 2] {
            for c in 2..LEG {
                let change = chain.torque_change(c, lam);
                for j in 2..c {
                    residual[j][c] -= change;
                    residual[c][j] -= change;
                }
                residual[c][c] -= change;
            }
        }
        Some(residual)
    }

    /// Change of the velocities `v`, and impulses on the free foot, by an impact with the further loads `x`. The
    /// contact point moves at `point` without them.
    #[inline(never)]
    fn velocity_change(
        &mut self,
        model: &Model,
        (mode, slip): (ContactMode, Slip),
        (v, loads, point): (&[R; NV], Option<&[R; NV]>, Vector3<R>),
    ) -> ([R; NV], Vector3<R>) {
        R::with_target_features(
            #[inline(always)]
            || {
                let (models, slip) = (Broadcast(model), slip.broadcast());
                let dynamics = &mut self.dynamics;
                let mut x = [R::zero(); NV];
                if let Some(loads) = loads {
                    x = *loads;
                    dynamics.tree.reduce_torques(models, &mut x);
                }
                dynamics.set_loads(model, &x, point);
                let root = Vector3::new(v[0], v[1], v[2]);
                let has_rows = dynamics.rows() > 0;
                let problem = &mut dynamics.problem;
                problem.b = vec3::add(&problem.b, &vec3::apply(&problem.S, &root));
                if has_rows {
                    let by_root = vec3::apply(&problem.G, &root);
                    problem.alpha0 = vec3::sub(&problem.alpha0, &by_root);
                }
                let (solution, _) = problem.regular_compact(mode, slip);
                let change = vec3::sub(&solution.a_root, &root);
                dynamics.back_substitute(models, (&change, &solution.lam), &mut x);
                (x, solution.lam)
            },
        )
    }

    /// Motion of all coordinates that removes a violation of the free foot's constraints, with further loads.
    #[inline(always)]
    fn correction(
        &mut self,
        model: &Model,
        mode: ContactMode,
        (loads, by): (Option<&[R; NV]>, Vector3<R>),
    ) -> [R; NV] {
        let still = [R::zero(); NV];
        self.velocity_change(model, (mode, Slip::default()), (&still, loads, by))
            .0
    }

    /// Projection onto the free foot's constraints: positions, then velocities.
    pub fn project(&mut self, model: &Model, mode: ContactMode, states: &mut [&mut Variation<R>]) {
        if mode.free.touch != SoleContact::Air
            && let Some(first) = states.first()
        {
            let projection = self.projection(model, mode, first);
            R::with_target_features(
                #[inline(always)]
                || {
                    for x in states {
                        let q = x.q;
                        self.project_positions(model, &projection, x);
                        let loads = loads(model.n, &projection.velocities, &q);
                        let mut velocity = projection.point.velocity(x);
                        projection.change.add_turning(&q, &mut velocity);
                        let step = self.correction(model, mode, (loads.as_ref(), velocity));
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
        model: &Model,
        (closed, projects): (ContactMode, bool),
        states: &mut [&mut Variation<R>],
    ) {
        for x in states.iter_mut() {
            if closed.support.touch != SoleContact::Air {
                x.q[1] = Dual::default();
                if closed.support.touch == SoleContact::Flat {
                    x.q[2] = Dual::default();
                }
            }
        }
        let slide = |foot: Foot| Foot::new(foot.touch, FrictionMode::Forward);
        let mode = ContactMode {
            support: slide(closed.support),
            free: slide(closed.free),
        };
        if projects && let Some(first) = states.first() {
            let projection = self.projection(model, mode, first);
            R::with_target_features(
                #[inline(always)]
                || {
                    for x in states {
                        self.project_positions(model, &projection, x);
                    }
                },
            );
        }
    }

    /// The projection from a state. Its changes s of the positions and of the velocities obey M s = f_r + J^T lam.
    fn projection(&mut self, model: &Model, mode: ContactMode, x: &Variation<R>) -> Projection {
        let (q, v) = (x.q.map(|q| q.x), x.v.map(|v| v.x));
        self.factor_at(model, mode, (&q, &v));
        let before = self.point(model, mode, &v);
        let (moved, lam) = self.close(model, mode, (&q, x.anchor.x));
        self.eval.set_velocities(model, mode, &v);
        let frictionless = (mode, Slip::default());
        let (step, impulse) = self.present_change(model, frictionless, &[0.0; NV]);
        let point = self.point(model, mode, &v);
        let change = self.point(model, mode, &step);
        let mut residuals = [None, None];
        let mut is_updated = false;
        for (residual, (change, lam)) in residuals.iter_mut().zip([(moved, lam), (step, impulse)]) {
            if change.iter().all(|x| x.abs() < NONE) {
                continue;
            }
            if !is_updated {
                self.eval.full_kinematics(model, mode.support.touch, &q, &v);
                is_updated = true;
            }
            *residual = self.residual(model, &before.chain, &change, lam);
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
    ) -> ([f64; NV], [f64; 2]) {
        let constraints = PositionConstraints {
            held: held(mode),
            anchor,
            tolerance: 1e-12,
        };
        let (mut change, mut sum) = (*q, [0.0; 2]);
        constraints.project(
            &mut self.eval,
            (model, &Stance::of(model, mode)),
            &mut change,
            true,
            |problem| {
                let solution = problem.solve(mode, Slip::default()).unwrap_or_default();
                sum = [0, 1].map(|i| sum[i] + solution.lam[i]);
                (solution, true)
            },
        );
        for (change, q) in change.iter_mut().zip(q) {
            *change -= q;
        }
        (change, sum)
    }

    /// `velocity_change` for the motion itself.
    fn present_change(
        &mut self,
        model: &Model,
        contact: (ContactMode, Slip),
        v: &[f64; NV],
    ) -> ([f64; NV], [f64; 2]) {
        let velocity = Vector3::from(broadcast(&self.eval.point_velocity));
        let motion = (&broadcast(v), None, velocity);
        let (change, lam) = self.velocity_change(model, contact, motion);
        (change.map(|x| x.lane(0)), [lam.x.lane(0), lam.y.lane(0)])
    }

    #[inline(always)]
    fn project_positions(&mut self, model: &Model, projection: &Projection, x: &mut Variation<R>) {
        let mode = projection.mode;
        // The factor belongs to the positions before the projection. Each further correction leaves about the change of
        // the positions of what the one before has left.
        let mut loads = loads(model.n, &projection.positions, &x.q);
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
            let step = self.correction(model, mode, (loads.as_ref(), violation));
            for c in 0..model.n {
                x.q[c].d += step[c];
            }
            loads = None;
        }
        for c in 0..model.n {
            x.q[c].x += projection.moved[c];
        }
    }

    /// Inelastic impact.
    pub fn impact(
        &mut self,
        model: &Model,
        (mode, has_friction): (ContactMode, bool),
        states: &mut [&mut Variation<R>],
    ) {
        let Some(first) = states.first() else {
            return;
        };
        let (q, v) = (first.q.map(|q| q.x), first.v.map(|v| v.x));
        let slip = match has_friction {
            true => Slip::of(model, mode),
            false => Slip::default(),
        };
        let impact = self.impact_at(model, (mode, slip), (&q, &v));
        R::with_target_features(
            #[inline(always)]
            || {
                for x in states {
                    self.apply_impact(model, &impact, x);
                }
            },
        );
    }

    fn impact_at(
        &mut self,
        model: &Model,
        (mode, slip): (ContactMode, Slip),
        (q, v): (&[f64; NV], &[f64; NV]),
    ) -> Impact {
        self.factor_at(model, mode, (q, v));
        let (change, lam) = self.present_change(model, (mode, slip), v);
        let mut after = *v;
        for c in 0..model.n {
            after[c] += change[c];
        }
        let point = self.point(model, mode, &after);
        self.eval
            .full_kinematics(model, mode.support.touch, q, &after);
        let residual = self.residual(model, &point.chain, &change, lam);
        Impact {
            mode,
            slip,
            point,
            after,
            residual,
        }
    }

    #[inline(always)]
    fn apply_impact(&mut self, model: &Model, impact: &Impact, x: &mut Variation<R>) {
        let loads = loads(model.n, &impact.residual, &x.q);
        let v = x.v.map(|v| v.d);
        let point = match impact.mode.free.touch {
            SoleContact::Air => vec3::zero(),
            _ => impact.point.velocity(x),
        };
        let contact = (impact.mode, impact.slip);
        let (change, _) = self.velocity_change(model, contact, (&v, loads.as_ref(), point));
        for c in 0..model.n {
            x.v[c].d += change[c];
            x.v[c].x = impact.after[c];
        }
    }
}

#[cfg(test)]
mod tests;
