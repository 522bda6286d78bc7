//! The right-hand side: positions and rates in, accelerations and contact forces out.

use crate::{
    articulated::{Articulated, Forces, LEG},
    contact::{
        ContactProblem, Mode, PHI, Slip, Solution, Touch, Z,
        select::{free_loads, slip, support_loads},
    },
    control::{self, Situation},
    dynamics::Inertias,
    error::EndCause,
    inertial,
    kinematics::{Kinematics, PlanarPoint},
    model::{FREE_FOOT, Model, NV, ROOT, coordinate},
    state::State,
};
use nalgebra::{Matrix3, Vector3};

/// Workspace of one evaluation. No field survives a change of the state it was made for.
#[derive(Debug, Clone, Default)]
// Where it lies across cache lines it costs a quarter more time.
#[repr(align(64))]
pub struct Evaluation {
    pub kin: Kinematics,
    pub inertias: Inertias,
    /// M, factored.
    pub M: Articulated,
    /// Applied generalised torque, baseline and residual [N m].
    pub tau: [f64; NV],
    /// Inertial and gravity forces on the bodies.
    forces: Forces,
    /// tau - D v - h - g, then reduced along the tree.
    reduced: [f64; NV],
    /// Reduced columns of the free foot's y, z, rotation, as many as it needs.
    columns: [[f64; LEG]; 3],
    /// Free foot's contact point from O [m], its velocity (y, z, rotation).
    pub point: PlanarPoint,
    pub point_velocity: [f64; 3],
    pub problem: ContactProblem,
    pub solution: Solution,
    /// q'' [rad/s2].
    pub qdd: [f64; NV],
    /// Evaluations so far.
    pub count: u64,
}

/// What does not change during a step.
#[derive(Debug, Clone, Copy)]
pub struct Frozen {
    pub mode: Mode,
    pub slip: Slip,
    pub now: Situation,
    /// Residual torque by coordinate; zero on the root [N m].
    pub residual: [f64; NV],
}

impl Frozen {
    pub fn of(model: &Model, state: &State, residual: &[f64; NV]) -> Self {
        Self {
            mode: state.mode,
            slip: slip(model, state.mode),
            now: Situation {
                t: state.t,
                clock: state.clock,
                mirrored: state.clock.leg != state.support_leg,
            },
            residual: *residual,
        }
    }
}

/// Ankle seen from the pivot, foot flat [m]: the toe is the pivot unless the foot stands on its heel.
pub fn pivot_to_ankle(model: &Model, support: Touch) -> [f64; 2] {
    let sole = &model.sole;
    let along = if support == Touch::Heel {
        sole.heel
    } else {
        sole.toe
    };
    [-along, -sole.z]
}

/// How many of the free foot's y, z, rotation its contact can hold: a point does not keep it from turning.
fn rows(free: Touch) -> usize {
    match free {
        Touch::Air => 0,
        Touch::Heel | Touch::Toe => 2,
        Touch::Flat => 3,
    }
}

impl Evaluation {
    /// Poses and velocities of all bodies: all that geometry needs.
    pub fn move_to(&mut self, model: &Model, support: Touch, q: &[f64; NV], v: &[f64; NV]) {
        self.kin.pivot_to_ankle = pivot_to_ankle(model, support);
        self.kin.positions(model, q);
        self.kin.velocities(model, v);
    }

    /// What a step needs of them.
    fn step_to(&mut self, model: &Model, support: Touch, q: &[f64; NV], v: &[f64; NV]) {
        self.kin.pivot_to_ankle = pivot_to_ankle(model, support);
        self.kin.frames(model, q);
        self.kin.planar_velocities(model, v);
    }

    /// Where a free foot on the ice is, and its velocity; M stays factored where it was.
    pub fn move_planar(&mut self, model: &Model, mode: Mode, q: &[f64; NV], v: &[f64; NV]) {
        self.step_to(model, mode.support.touch, q, v);
        self.touch_point(model, mode.free.touch);
    }

    /// The free foot's contact point: its toe if only the toe touches, else its heel.
    fn touch_point(&mut self, model: &Model, free: Touch) {
        let along = if free == Touch::Toe {
            model.sole.toe
        } else {
            model.sole.heel
        };
        self.point = self.kin.sole_point(model, along);
        let point = Vector3::new(0.0, self.point.y, self.point.z);
        let velocity = self.kin.point_velocity(FREE_FOOT, &point);
        self.point_velocity = [velocity.y, velocity.z, self.kin.w[FREE_FOOT].x];
    }

    /// Poses, velocities and inertias of all bodies: all that energy and momentum need.
    pub fn survey(&mut self, model: &Model, support: Touch, q: &[f64; NV], v: &[f64; NV]) {
        self.move_to(model, support, q, v);
        self.inertias.update(model, &self.kin);
    }

    /// Factor M and set up the contact problem's S, and for a free foot on the ice (or about to be)
    /// its G and W, at the toe if only the toe touches, else at the heel.
    pub fn assemble(&mut self, model: &Model, free: Touch) {
        self.M.factor(model, &self.kin);
        self.problem.S = self.M.root();
        if free == Touch::Air {
            return;
        }
        self.touch_point(model, free);
        let columns = &mut self.columns[..rows(free)];
        self.M
            .reduce_unit_forces([self.point.y, self.point.z], columns);
        let (mut G, mut W) = (Matrix3::zeros(), Matrix3::zeros());
        for i in 0..rows(free) {
            for j in 0..3 {
                G[(i, j)] = self.columns[i][j];
            }
            for j in 0..=i {
                let sum: f64 = (ROOT..LEG)
                    .map(|c| self.columns[i][c] * self.columns[j][c] * self.M.inverse_d(c))
                    .sum();
                W[(i, j)] = sum;
                W[(j, i)] = sum;
            }
        }
        (self.problem.G, self.problem.W) = (G, W);
    }

    /// Applied torques and the acceleration-level right-hand sides b and alpha0.
    pub fn load(
        &mut self,
        model: &Model,
        free: Touch,
        q: &[f64; NV],
        v: &[f64; NV],
        frozen: &Frozen,
    ) {
        let baseline = control::baseline(model, &mut self.kin, v, q, &frozen.now);
        for c in 0..model.n.min(NV) {
            self.tau[c] = baseline[c] + frozen.residual[c];
            self.reduced[c] = self.tau[c];
        }
        for c in model.damped.clone() {
            self.reduced[c] -= model.damping[c] * v[c];
        }
        inertial::forces(model, &self.kin, v, &mut self.forces);
        self.M
            .reduce(model, &self.kin, &mut self.forces, &mut self.reduced);
        self.problem.b = Vector3::new(self.reduced[0], self.reduced[1], self.reduced[2]);
        if free != Touch::Air {
            let point = Vector3::new(0.0, self.point.y, self.point.z);
            let rate = self.kin.point_bias(FREE_FOOT, &point);
            self.problem.alpha0 = Vector3::new(rate.y, rate.z, self.kin.dw[FREE_FOOT].x);
            for i in 0..rows(free) {
                for c in ROOT..LEG {
                    self.problem.alpha0[i] +=
                        self.columns[i][c] * self.M.inverse_d(c) * self.reduced[c];
                }
            }
        }
    }

    /// Accelerations and forces in the frozen mode.
    ///
    /// # Errors
    /// `Singular` or `NotFinite`, where the contact equations have no solution.
    pub fn accelerations(
        &mut self,
        model: &Model,
        q: &[f64; NV],
        v: &[f64; NV],
        frozen: &Frozen,
    ) -> Result<(), EndCause> {
        self.count += 1;
        let free = frozen.mode.free.touch;
        self.step_to(model, frozen.mode.support.touch, q, v);
        self.assemble(model, free);
        self.load(model, free, q, v, frozen);
        self.solution = self.problem.solve(frozen.mode, frozen.slip)?;
        let n = model.n.min(NV);
        self.qdd[..n].copy_from_slice(&self.reduced[..n]);
        let (a_root, lam) = (self.solution.a_root, self.solution.lam);
        self.spread(model, free, &a_root, &lam);
        // Not finite if one of them is not.
        if !self.qdd[..n]
            .iter()
            .map(|a| a * 0.0)
            .sum::<f64>()
            .is_finite()
        {
            return Err(EndCause::NotFinite);
        }
        Ok(())
    }

    /// Back-substitution: `qdd` holds reduced joint forces on entry, motion of all coordinates after.
    fn spread(&mut self, model: &Model, free: Touch, root: &Vector3<f64>, lam: &Vector3<f64>) {
        for i in 0..ROOT {
            self.qdd[i] = root[i];
        }
        for i in 0..rows(free) {
            for c in ROOT..LEG {
                self.qdd[c] += self.columns[i][c] * lam[i];
            }
        }
        self.M.expand(model, &self.kin, &mut self.qdd);
    }

    /// Motion of all coordinates that the root's motion and impulses on the free foot cause: M^-1
    /// times them, for impacts and projections. Needs `assemble`.
    pub fn response(
        &mut self,
        model: &Model,
        free: Touch,
        root: &Vector3<f64>,
        impulse: &Vector3<f64>,
    ) -> [f64; NV] {
        self.qdd = [0.0; NV];
        self.spread(model, free, root, impulse);
        self.qdd
    }

    /// Normal forces (heel, toe) of the supporting and the free foot [N].
    pub fn loads(&self, model: &Model, mode: Mode) -> [[f64; 2]; 2] {
        let length = model.sole.length();
        let (f, lam) = (&self.solution.f_root, &self.solution.lam);
        [
            support_loads(mode.support.touch, f[Z], f[PHI], length),
            free_loads(mode.free.touch, lam[Z], lam[PHI], length),
        ]
    }

    /// Heights above the ice of the heel and toe of the supporting and the free foot [m].
    pub fn gaps(&self, model: &Model, support: Touch, z0: f64) -> [[f64; 2]; 2] {
        let rise = model.sole.length() * self.kin.sin_cos[0].0;
        let own = if support == Touch::Heel {
            [z0, z0 + rise]
        } else {
            [z0 - rise, z0]
        };
        let heel = self.kin.sole_point(model, model.sole.heel).z + z0;
        let toe = self.kin.sole_point(model, model.sole.toe).z + z0;
        [own, [heel, toe]]
    }

    /// Index of the coordinate of the free ankle, q7.
    pub const Q7: usize = coordinate(FREE_FOOT);
}
