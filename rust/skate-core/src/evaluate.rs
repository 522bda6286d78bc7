//! The right-hand side: positions and rates in, accelerations and contact forces out.

use crate::{
    articulated::Forces,
    contact::{
        Mode, PHI, Slip, Solution, Touch, Z,
        select::{free_loads, slip, support_loads},
    },
    control::{self, Situation},
    dynamics::Inertias,
    error::EndCause,
    factored::Factored,
    guards::{End, FREE, SUPPORT},
    inertial,
    kinematics::{Kinematics, PlanarPoint},
    model::{FREE_FOOT, Model, NV, coordinate},
    state::State,
};
use nalgebra::Vector3;

/// Workspace of one evaluation. No field survives a change of the state it was made for.
#[derive(Debug, Clone, Default)]
// Where it lies across cache lines it costs a quarter more time.
#[repr(align(64))]
pub struct Evaluation {
    pub kin: Kinematics,
    pub inertias: Inertias,
    /// M, factored, and the contact problem.
    pub factored: Factored,
    /// Applied generalised torque, baseline and residual [N m].
    pub tau: [f64; NV],
    /// Inertial and gravity forces on the bodies.
    forces: Forces,
    /// tau - D v - h - g, then reduced along the tree.
    reduced: [f64; NV],
    /// Free foot's contact point from O [m], its velocity (y, z, rotation).
    pub point: PlanarPoint,
    pub point_velocity: [f64; 3],
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
            now: Situation::of(state),
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

impl Evaluation {
    /// Poses and velocities of all bodies: all that geometry needs.
    pub fn move_to(&mut self, model: &Model, support: Touch, q: &[f64; NV], v: &[f64; NV]) {
        self.kin.pivot_to_ankle = pivot_to_ankle(model, support);
        self.kin.positions(model, q);
        self.kin.velocities(model, v);
    }

    /// What a step needs of them.
    pub(crate) fn step_to(&mut self, model: &Model, support: Touch, q: &[f64; NV], v: &[f64; NV]) {
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
        self.assemble_with(model, free, 0.0);
    }

    /// The same with M + g D for M, D being the friction of the joints.
    pub fn assemble_with(&mut self, model: &Model, free: Touch, g: f64) {
        if free != Touch::Air {
            self.touch_point(model, free);
        }
        self.factored
            .factor(model, &self.kin, (free, self.point), g);
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
        self.apply_torques(model, q, v, frozen);
        self.reduce_forces(model, v, v);
        let (kin, at) = (&self.kin, self.point);
        self.factored.load(model, free, &self.reduced, || {
            let rate = kin.point_bias(FREE_FOOT, &Vector3::new(0.0, at.y, at.z));
            Vector3::new(rate.y, rate.z, kin.dw[FREE_FOOT].x)
        });
    }

    /// The same for velocities and impulses over `h` seconds instead of accelerations and forces, with
    /// the torques that `apply_torques` found. The inertial forces see the velocities `mean`.
    pub fn load_momentum(
        &mut self,
        model: &Model,
        free: Touch,
        (v, mean): (&[f64; NV], &[f64; NV]),
        h: f64,
    ) {
        self.reduce_forces(model, mean, v);
        self.reduced.iter_mut().for_each(|force| *force *= h);
        self.factored
            .load(model, free, &self.reduced, Vector3::zeros);
        let root = Vector3::new(v[0], v[1], v[2]);
        let problem = &mut self.factored.problem;
        problem.b += problem.S * root;
        if free != Touch::Air {
            problem.alpha0 += Vector3::from(self.point_velocity) - problem.G * root;
        }
    }

    /// What `load_momentum`'s forces and a solution of its contact problem change the velocities by.
    pub fn change(
        &mut self,
        model: &Model,
        free: Touch,
        v: &[f64; NV],
        solution: &Solution,
    ) -> [f64; NV] {
        let mut change = self.reduced;
        let root = solution.a_root - Vector3::new(v[0], v[1], v[2]);
        self.factored
            .spread(model, free, (&root, &solution.lam), &mut change);
        change
    }

    /// The controller's torques and the held ones.
    pub(crate) fn apply_torques(
        &mut self,
        model: &Model,
        q: &[f64; NV],
        v: &[f64; NV],
        frozen: &Frozen,
    ) {
        let baseline = control::baseline(model, &mut self.kin, v, q, &frozen.now);
        for c in 0..model.n.min(NV) {
            self.tau[c] = baseline[c] + frozen.residual[c];
        }
    }

    /// Torques, the joints' friction at the rates `damped`, inertial and gravity forces at the velocities
    /// `v`: reduced along the tree.
    fn reduce_forces(&mut self, model: &Model, v: &[f64; NV], damped: &[f64; NV]) {
        let n = model.n.min(NV);
        self.reduced[..n].copy_from_slice(&self.tau[..n]);
        for c in model.damped.clone() {
            self.reduced[c] -= model.damping[c] * damped[c];
        }
        inertial::forces(model, &self.kin, v, &mut self.forces);
        self.factored
            .tree
            .reduce(model, &mut self.forces, &mut self.reduced);
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
        self.solution = self.factored.problem.solve(frozen.mode, frozen.slip)?;
        if frozen.mode.free.touch == Touch::Air {
            // No point of a foot in the air is looked at.
            self.solution.a_free = Vector3::zeros();
        }
        let n = model.n.min(NV);
        self.qdd[..n].copy_from_slice(&self.reduced[..n]);
        let (a_root, lam) = (self.solution.a_root, self.solution.lam);
        self.factored
            .spread(model, free, (&a_root, &lam), &mut self.qdd);
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
        self.factored.unload();
        self.factored
            .spread(model, free, (root, impulse), &mut self.qdd);
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
        let ends = [End::Heel, End::Toe];
        [SUPPORT, FREE].map(|foot| ends.map(|end| self.gap(model, support, z0, (foot, end))))
    }

    /// One of them.
    #[inline]
    pub fn gap(&self, model: &Model, support: Touch, z0: f64, (foot, end): (usize, End)) -> f64 {
        let sole = &model.sole;
        if foot == FREE {
            let along = if end == End::Heel {
                sole.heel
            } else {
                sole.toe
            };
            return z0 + self.kin.sole_point(model, along).z;
        }
        let rise = sole.length() * self.kin.sin_cos[0].0;
        match (support == Touch::Heel, end) {
            (true, End::Heel) | (false, End::Toe) => z0,
            (true, End::Toe) => z0 + rise,
            (false, End::Heel) => z0 - rise,
        }
    }

    /// Index of the coordinate of the free ankle, q7.
    pub const Q7: usize = coordinate(FREE_FOOT);
}
