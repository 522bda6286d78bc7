//! The right-hand side: positions and rates in, accelerations and contact forces out.

pub mod jacobian;
pub mod link_segments;
pub mod projection;
pub mod sole_points;

use crate::{
    contact::{
        equations::{Slip, Solution, Y, Z},
        mode_selection::{loads, slip},
    },
    control::{self, ControllerInput},
    dynamics::{
        aba::Forces,
        bias_forces,
        crba_rnea::Inertias,
        delassus::{FactoredDynamics, rows},
        kinematics::{Kinematics, PlanarPoint},
    },
    error::Termination,
    model::{
        Model,
        contact_mode::{ContactMode, End, FREE, SoleContact},
        lanes::ModelLanes,
        layout::{FREE_FOOT, NV, coordinate},
        state::State,
    },
    numeric::{scalar::Scalar, simd::with_avx2, vec3},
};
use nalgebra::Vector3;

/// Workspace of one evaluation. No field survives a change of the state it was made for.
#[derive(Debug, Clone, Default)]
// Where it lies across cache lines it costs a quarter more time.
#[repr(align(64))]
pub struct Evaluation<T: Scalar = f64> {
    pub kin: Kinematics<T>,
    pub inertias: Inertias,
    /// M, factored, and the contact problem.
    pub factored: FactoredDynamics<T>,
    /// Applied generalised torque, baseline and residual [N m].
    pub tau: [T; NV],
    /// Inertial and gravity forces on the bodies.
    forces: Forces<T>,
    /// tau - D v - h - g, then reduced along the tree.
    reduced: [T; NV],
    /// Free foot's contact point from O [m], its velocity (y, z, rotation).
    pub point: PlanarPoint<T>,
    pub point_velocity: [T; 3],
    /// What half a time step changes that velocity by, y and z, because the point moves on (`assemble_impulse_problem`).
    pub drift: [T; 2],
    pub solution: Solution<T>,
    /// q'' [rad/s2].
    pub qdd: [T; NV],
    /// Evaluations so far.
    pub count: u64,
}

/// What does not change during a step.
#[derive(Debug, Clone, Copy)]
pub struct StepContext {
    pub mode: ContactMode,
    pub slip: Slip,
    pub now: ControllerInput,
    /// Residual torque by coordinate; zero on the root [N m].
    pub residual: [f64; NV],
}

impl StepContext {
    pub fn of(model: &Model, state: &State, residual: &[f64; NV]) -> Self {
        Self {
            mode: state.mode,
            slip: slip(model, state.mode),
            now: ControllerInput::of(state),
            residual: *residual,
        }
    }
}

/// Ankle seen from the pivot, foot flat [m]: the toe is the pivot unless the foot stands on its heel.
pub fn pivot_to_ankle(model: &Model, support: SoleContact) -> [f64; 2] {
    let sole = &model.sole;
    let along = if support == SoleContact::Heel {
        sole.heel
    } else {
        sole.toe
    };
    [-along, -sole.z]
}

/// Contact point of a free foot ahead of its ankle [m]: its toe if only the toe touches, else its heel.
pub fn ankle_to_point(model: &Model, free: SoleContact) -> f64 {
    if free == SoleContact::Toe {
        model.sole.toe
    } else {
        model.sole.heel
    }
}

/// What the equations need to know of how the feet stand, lane by lane.
#[derive(Debug, Clone, Copy)]
pub struct Stance<T> {
    pub pivot_to_ankle: [T; 2],
    pub ankle_to_point: T,
    /// How many of the free foot's y, z, rotation contacts can hold: in the lane with the most.
    pub rows: usize,
}

impl Stance<f64> {
    pub fn of(model: &Model, mode: ContactMode) -> Self {
        let (support, free) = (mode.support.touch, mode.free.touch);
        Self {
            pivot_to_ankle: pivot_to_ankle(model, support),
            ankle_to_point: ankle_to_point(model, free),
            rows: rows(free),
        }
    }
}

impl<T: Scalar> Evaluation<T> {
    /// Poses and velocities of all bodies but the arms.
    #[inline(always)]
    pub fn update_kinematics(
        &mut self,
        models: impl ModelLanes<T>,
        stance: &Stance<T>,
        q: &[T; NV],
        v: &[T; NV],
    ) {
        self.kin.pivot_to_ankle = stance.pivot_to_ankle;
        self.kin.frames(models, q);
        self.kin.planar_velocities(models.shape(), v);
        if stance.rows > 0 {
            self.update_contact_point(models, stance.ankle_to_point);
        }
    }

    /// The legs alone; their velocities and the upper body follow with `finish`.
    #[inline(always)]
    pub fn update_leg_kinematics(
        &mut self,
        models: impl ModelLanes<T>,
        stance: &Stance<T>,
        q: &[T; NV],
    ) {
        self.kin.pivot_to_ankle = stance.pivot_to_ankle;
        self.kin.legs(models, q);
        if stance.rows > 0 {
            self.point = self.kin.sole_point(models, stance.ankle_to_point);
        }
    }

    /// All but the arms, after `update_leg_kinematics`.
    #[inline(always)]
    pub fn finish(&mut self, models: impl ModelLanes<T>, q: &[T; NV], v: &[T; NV]) {
        self.kin.trunk_and_head(models, q);
        self.kin.planar_velocities(models.shape(), v);
    }

    /// The free foot's contact point, `along` ahead of its ankle.
    #[inline(always)]
    fn update_contact_point(&mut self, models: impl ModelLanes<T>, along: T) {
        self.point = self.kin.sole_point(models, along);
        let point = Vector3::new(T::zero(), self.point.y, self.point.z);
        let velocity = self.kin.point_velocity(FREE_FOOT, &point);
        self.point_velocity = [velocity.y, velocity.z, self.kin.w[FREE_FOOT].x];
    }

    /// Factor M + g D (None: M), D being the friction of the joints, and set up the contact problem's S, and
    /// if contacts hold the free foot its G and W.
    #[inline(always)]
    pub fn factor(&mut self, models: impl ModelLanes<T>, rows: usize, g: Option<T>) {
        self.factored
            .factor(models, &self.kin, (rows, self.point), g);
    }

    /// The controller's torques, the printed among them being known, and the held ones.
    #[inline(always)]
    pub fn control(
        &mut self,
        models: impl ModelLanes<T>,
        q: &[T; NV],
        v: &[T; NV],
        now: &[ControllerInput],
        (printed, residual): (&[T; NV], &[T; NV]),
    ) {
        self.tau = *printed;
        control::add_feedback(models, &mut self.kin, (q, v), now, &mut self.tau);
        for c in 0..models.shape().n.min(NV) {
            self.tau[c] += residual[c];
        }
    }

    /// Torques, the joints' friction at the rates `damped`, inertial and gravity forces at the velocities
    /// `v`: reduced along the tree.
    #[inline(always)]
    fn reduce_forces(&mut self, models: impl ModelLanes<T>, v: &[T; NV], damped: &[T; NV]) {
        let model = models.shape();
        let n = model.n.min(NV);
        self.reduced[..n].copy_from_slice(&self.tau[..n]);
        for c in model.damped.clone() {
            self.reduced[c] -= models.number(|m| m.damping[c]) * damped[c];
        }
        bias_forces::forces(models, &self.kin, v, &mut self.forces);
        self.factored
            .tree
            .reduce(models, &mut self.forces, &mut self.reduced);
    }

    /// The contact problem's b and alpha0 for velocities and impulses over `h` seconds instead of
    /// accelerations and forces, with the torques that `control` found. The inertial forces see the
    /// velocities `mean`; the free foot's motion is that at the end.
    #[inline(always)]
    pub fn assemble_impulse_problem(
        &mut self,
        models: impl ModelLanes<T>,
        (v, mean): (&[T; NV], &[T; NV]),
        h: T,
    ) {
        self.reduce_forces(models, mean, v);
        for force in &mut self.reduced {
            *force *= h;
        }
        self.factored
            .set_loads(models.shape(), &self.reduced, vec3::zero());
        let root = Vector3::new(v[0], v[1], v[2]);
        let held = self.factored.rows() > 0;
        let problem = &mut self.factored.problem;
        problem.b = vec3::add(&problem.b, &vec3::apply(&problem.S, &root));
        if held {
            let [y, z, turn] = self.point_velocity;
            let own = vec3::sub(&Vector3::new(y, z, turn), &vec3::apply(&problem.G, &root));
            problem.alpha0 = vec3::add(&problem.alpha0, &own);
            // New velocities are asked for where the point is at the end: J v there is J v in the middle
            // and h/2 J' v.
            let rate = self
                .kin
                .acceleration(FREE_FOOT, [self.point.y, self.point.z]);
            self.drift = rate.map(|rate| T::of(0.5) * h * rate);
            problem.alpha0[Y] += self.drift[Y];
            problem.alpha0[Z] += self.drift[Z];
        }
    }

    /// What `assemble_impulse_problem`'s forces and a solution of its contact problem change the velocities by.
    #[inline(always)]
    pub fn velocity_change(
        &mut self,
        models: impl ModelLanes<T>,
        v: &[T; NV],
        solution: &Solution<T>,
    ) -> &[T; NV] {
        let root = vec3::sub(&solution.a_root, &Vector3::new(v[0], v[1], v[2]));
        self.factored
            .back_substitute(models, (&root, &solution.lam), &mut self.reduced);
        &self.reduced
    }

    /// Motion of all coordinates that the root's motion and impulses on the free foot cause: M^-1
    /// times them, for impacts and projections. Needs a factor.
    #[inline(always)]
    pub fn response(
        &mut self,
        models: impl ModelLanes<T>,
        root: &Vector3<T>,
        impulse: &Vector3<T>,
    ) -> &[T; NV] {
        self.qdd = [T::zero(); NV];
        self.factored.clear_loads();
        self.factored
            .back_substitute(models, (root, impulse), &mut self.qdd);
        &self.qdd
    }
}

impl Evaluation {
    /// Poses and velocities of all bodies: all that geometry needs.
    pub fn move_to(&mut self, model: &Model, support: SoleContact, q: &[f64; NV], v: &[f64; NV]) {
        self.kin.pivot_to_ankle = pivot_to_ankle(model, support);
        self.kin.positions(model, q);
        self.kin.velocities(model, v);
    }

    /// Where all bodies but the arms are, and a free foot on the ice, and their velocities; M stays factored
    /// where it was.
    pub fn move_planar(&mut self, model: &Model, mode: ContactMode, q: &[f64; NV], v: &[f64; NV]) {
        with_avx2(
            #[inline(always)]
            || self.update_kinematics(model, &Stance::of(model, mode), q, v),
        );
        if mode.free.touch == SoleContact::Air {
            self.update_contact_point(model, model.sole.heel);
        }
    }

    /// The same of the legs alone.
    pub fn move_legs(&mut self, model: &Model, mode: ContactMode, q: &[f64; NV], v: &[f64; NV]) {
        with_avx2(
            #[inline(always)]
            || self.update_leg_kinematics(model, &Stance::of(model, mode), q),
        );
        self.change_velocities(model, mode, v);
    }

    /// Velocities of the legs and of the free foot's contact point, where they are.
    pub fn change_velocities(&mut self, model: &Model, mode: ContactMode, v: &[f64; NV]) {
        self.kin.planar_velocities(model, v);
        self.update_contact_point(model, ankle_to_point(model, mode.free.touch));
    }

    /// Poses, velocities and inertias of all bodies: all that M, bias and momentum need.
    pub fn full_kinematics(
        &mut self,
        model: &Model,
        support: SoleContact,
        q: &[f64; NV],
        v: &[f64; NV],
    ) {
        self.move_to(model, support, q, v);
        self.inertias.update(model, &self.kin);
    }

    /// Factor M and set up the contact problem's S, and for a free foot on the ice (or about to be)
    /// its G and W, at the toe if only the toe touches, else at the heel.
    pub fn assemble(&mut self, model: &Model, free: SoleContact) {
        if free != SoleContact::Air {
            self.update_contact_point(model, ankle_to_point(model, free));
        }
        with_avx2(
            #[inline(always)]
            || self.factor(model, rows(free), None),
        );
    }

    /// Applied torques and the acceleration-level right-hand sides b and alpha0.
    #[inline(always)]
    pub fn load(&mut self, model: &Model, q: &[f64; NV], v: &[f64; NV], frozen: &StepContext) {
        let now = std::slice::from_ref(&frozen.now);
        let printed = control::open_loop_torques(model, now);
        self.control(model, q, v, now, (&printed, &frozen.residual));
        self.reduce_forces(model, v, v);
        let (kin, at) = (&self.kin, self.point);
        let mut rate = Vector3::zeros();
        if self.factored.rows() > 0 {
            let bias = kin.point_bias(FREE_FOOT, &Vector3::new(0.0, at.y, at.z));
            rate = Vector3::new(bias.y, bias.z, kin.dw[FREE_FOOT].x);
        }
        self.factored.set_loads(model, &self.reduced, rate);
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
        frozen: &StepContext,
    ) -> Result<(), Termination> {
        self.count += 1;
        with_avx2(
            #[inline(always)]
            || {
                let stance = Stance::of(model, frozen.mode);
                self.update_kinematics(model, &stance, q, v);
                self.factor(model, stance.rows, None);
                self.load(model, q, v, frozen);
                let problem = &self.factored.problem;
                let (solution, regular) = problem.regular(frozen.mode, frozen.slip);
                self.solution = solution;
                if !regular {
                    self.solution = problem.solve_dependent(frozen.mode, frozen.slip)?;
                }
                if frozen.mode.free.touch == SoleContact::Air {
                    // No point of a foot in the air is looked at.
                    self.solution.a_free = Vector3::zeros();
                }
                let n = model.n.min(NV);
                self.qdd[..n].copy_from_slice(&self.reduced[..n]);
                let (a_root, lam) = (self.solution.a_root, self.solution.lam);
                self.factored
                    .back_substitute(model, (&a_root, &lam), &mut self.qdd);
                // Not finite if one of them is not.
                if !self.qdd[..n]
                    .iter()
                    .map(|a| a * 0.0)
                    .sum::<f64>()
                    .is_finite()
                {
                    return Err(Termination::NotFinite);
                }
                Ok(())
            },
        )
    }

    /// Normal forces (heel, toe) of the supporting and the free foot [N].
    pub fn loads(&self, model: &Model, mode: ContactMode) -> [[f64; 2]; 2] {
        loads(model, mode, &self.solution)
    }

    /// Height above the ice of an end of a sole [m].
    #[inline]
    pub fn gap(
        &self,
        model: &Model,
        support: SoleContact,
        z0: f64,
        (foot, end): (usize, End),
    ) -> f64 {
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
        match (support == SoleContact::Heel, end) {
            (true, End::Heel) | (false, End::Toe) => z0,
            (true, End::Toe) => z0 + rise,
            (false, End::Heel) => z0 - rise,
        }
    }

    /// Index of the coordinate of the free ankle, q7.
    pub const Q7: usize = coordinate(FREE_FOOT);
}
