//! The right-hand side of the equations of motion: positions and velocities in, accelerations and contact
//! forces out. `Evaluation::accelerations` lists the steps.

mod geometry;
mod impulses;
pub mod jacobian;
pub mod link_segments;
pub mod projection;
pub mod sole_points;

use crate::{
    contact::{
        equations::{Slip, Solution},
        loads::loads,
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
        contact_mode::{ContactMode, SoleContact},
        lanes::ModelLanes,
        layout::{FREE_FOOT, NV, coordinate},
        state::State,
    },
    numeric::{scalar::Scalar, simd::with_avx2, vec3},
};
use nalgebra::Vector3;

/// Workspace and results of one evaluation. A change of the state invalidates every field.
#[derive(Debug, Clone, Default)]
// Without alignment to cache lines an evaluation takes a quarter more time.
#[repr(align(64))]
pub struct Evaluation<T: Scalar = f64> {
    pub kin: Kinematics<T>,
    pub inertias: Inertias,
    /// M, factored, and the contact problem.
    pub factored: FactoredDynamics<T>,
    /// Applied generalised torque, controller and residual [N m].
    pub tau: [T; NV],
    /// Inertial and gravity forces on the bodies.
    forces: Forces<T>,
    /// tau - D v - h - g, then reduced along the tree.
    reduced: [T; NV],
    /// Free foot's contact point from O [m], and its velocity (y, z, rotation).
    pub point: PlanarPoint<T>,
    pub point_velocity: [T; 3],
    /// h/2 J' v: change of that velocity (y, z) over half a time step because the point moves
    /// (`assemble_impulse_problem`).
    pub drift: [T; 2],
    pub solution: Solution<T>,
    /// q'' [rad/s2].
    pub qdd: [T; NV],
    /// Evaluations so far.
    pub count: u64,
}

/// What is constant during a time step.
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
            slip: Slip::of(model, state.mode),
            now: ControllerInput::of(state),
            residual: *residual,
        }
    }
}

/// Position of the ankle from the pivot, foot flat [m].
pub fn pivot_to_ankle(model: &Model, support: SoleContact) -> [f64; 2] {
    let sole = &model.sole;
    [-sole.ahead_of_ankle(support.pivot()), -sole.z]
}

/// Distance of a free foot's contact point in front of its ankle [m].
pub fn ankle_to_point(model: &Model, free: SoleContact) -> f64 {
    model.sole.ahead_of_ankle(free.contact_point())
}

/// Contact geometry of both feet, lane by lane.
#[derive(Debug, Clone, Copy)]
pub struct Stance<T> {
    pub pivot_to_ankle: [T; 2],
    pub ankle_to_point: T,
    /// Number of constraints of the free foot, in the lane with the most.
    pub rows: usize,
}

impl Stance<f64> {
    /// The same in every lane.
    #[inline(always)]
    pub fn broadcast<T: Scalar>(&self) -> Stance<T> {
        Stance {
            pivot_to_ankle: self.pivot_to_ankle.map(T::of),
            ankle_to_point: T::of(self.ankle_to_point),
            rows: self.rows,
        }
    }

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
    /// Factor M + g D (`None`: M), D being joint friction, and set up the contact problem's S and, for a free
    /// foot on the ice, its G and W (Eq. 12).
    #[inline(always)]
    pub fn factor(&mut self, models: impl ModelLanes<T>, rows: usize, g: Option<T>) {
        self.factored
            .factor(models, &self.kin, (rows, self.point), g);
    }

    /// Applied torques: the controller's, of which `feedforward` is given, and the residual.
    #[inline(always)]
    pub fn control(
        &mut self,
        models: impl ModelLanes<T>,
        q: &[T; NV],
        v: &[T; NV],
        now: &[ControllerInput],
        (feedforward, residual): (&[T; NV], &[T; NV]),
    ) {
        self.tau = *feedforward;
        control::add_feedback(models, &mut self.kin, (q, v), now, &mut self.tau);
        for c in 0..models.shape().n.min(NV) {
            self.tau[c] += residual[c];
        }
    }

    /// Reduce tau - D v_d - h(v) - g along the tree (Featherstone 2008, ch. 7): applied torques, joint friction
    /// at the velocities `damped`, inertial forces at the velocities `v`, gravity.
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

    /// b from the reduced forces, alpha0 with the bias acceleration J' v of the free foot's contact point.
    #[inline(always)]
    fn set_contact_loads(&mut self, model: &Model) {
        let (kin, at) = (&self.kin, self.point);
        let mut bias = vec3::zero();
        if self.factored.rows() > 0 {
            let linear = kin.point_bias(FREE_FOOT, &Vector3::new(T::zero(), at.y, at.z));
            bias = Vector3::new(linear.y, linear.z, kin.dw[FREE_FOOT].x);
        }
        self.factored.set_loads(model, &self.reduced, bias);
    }

    /// Contact problem with its loads at (q, v), for torques that are known up to the feedback.
    #[inline(always)]
    pub fn assemble_with(
        &mut self,
        models: impl ModelLanes<T>,
        stance: &Stance<T>,
        (q, v): (&[T; NV], &[T; NV]),
        now: &[ControllerInput],
        (feedforward, residual): (&[T; NV], &[T; NV]),
    ) {
        self.update_kinematics(models, stance, q, v);
        self.factor(models, stance.rows, None);
        self.load_with(models, (q, v), now, (feedforward, residual));
    }

    /// The loads of `assemble_with`.
    #[inline(always)]
    pub fn load_with(
        &mut self,
        models: impl ModelLanes<T>,
        (q, v): (&[T; NV], &[T; NV]),
        now: &[ControllerInput],
        (feedforward, residual): (&[T; NV], &[T; NV]),
    ) {
        self.control(models, q, v, now, (feedforward, residual));
        self.reduce_forces(models, v, v);
        self.set_contact_loads(models.shape());
    }

    /// q'' from the motion of the root and the forces on the free foot.
    #[inline(always)]
    pub fn back_substitute(&mut self, models: impl ModelLanes<T>) {
        let n = models.shape().n.min(NV);
        self.qdd[..n].copy_from_slice(&self.reduced[..n]);
        let (a_root, lam) = (self.solution.a_root, self.solution.lam);
        self.factored
            .back_substitute(models, (&a_root, &lam), &mut self.qdd);
    }
}

impl Evaluation {
    /// Accelerations and contact forces (Eq. 13) in the contact mode of `context`.
    ///
    /// # Errors
    /// `Singular` or `NotFinite` where the contact equations have no solution.
    pub fn accelerations(
        &mut self,
        model: &Model,
        q: &[f64; NV],
        v: &[f64; NV],
        context: &StepContext,
    ) -> Result<(), Termination> {
        self.count += 1;
        with_avx2(
            #[inline(always)]
            || {
                let stance = Stance::of(model, context.mode);
                let now = std::slice::from_ref(&context.now);
                let feedforward = control::open_loop_torques(model, now);
                let torques = (&feedforward, &context.residual);
                self.assemble_with(model, &stance, (q, v), now, torques);
                self.solve_contacts(context)?;
                self.back_substitute(model);
                self.check_finite(model)
            },
        )
    }

    /// Factor M and set up the contact problem's S and, for a free foot with the contact `free`, G and W.
    pub fn assemble(&mut self, model: &Model, free: SoleContact) {
        if free != SoleContact::Air {
            self.update_contact_point(model, ankle_to_point(model, free));
        }
        with_avx2(
            #[inline(always)]
            || self.factor(model, rows(free), None),
        );
    }

    /// Right-hand sides b and alpha0 of the contact problem after `assemble`.
    pub fn assemble_loads(
        &mut self,
        model: &Model,
        q: &[f64; NV],
        v: &[f64; NV],
        context: &StepContext,
    ) {
        self.apply_torques(model, q, v, context);
        self.reduce_forces(model, v, v);
        self.set_contact_loads(model);
    }

    /// tau: feedforward, feedback and residual.
    #[inline(always)]
    fn apply_torques(
        &mut self,
        model: &Model,
        q: &[f64; NV],
        v: &[f64; NV],
        context: &StepContext,
    ) {
        let now = std::slice::from_ref(&context.now);
        let feedforward = control::open_loop_torques(model, now);
        self.control(model, q, v, now, (&feedforward, &context.residual));
    }

    /// Motion of the feet and contact forces.
    #[inline(always)]
    fn solve_contacts(&mut self, context: &StepContext) -> Result<(), Termination> {
        let problem = &self.factored.problem;
        let (solution, regular) = problem.regular(context.mode, context.slip);
        self.solution = solution;
        if !regular {
            self.solution = problem.solve_dependent(context.mode, context.slip)?;
        }
        if context.mode.free.touch == SoleContact::Air {
            // The contact point of a foot in the air was not computed.
            self.solution.a_free = Vector3::zeros();
        }
        Ok(())
    }

    #[inline(always)]
    fn check_finite(&self, model: &Model) -> Result<(), Termination> {
        // The sum of a * 0 is finite only if every a is.
        let n = model.n.min(NV);
        let sum: f64 = self.qdd[..n].iter().map(|a| a * 0.0).sum();
        if sum.is_finite() {
            Ok(())
        } else {
            Err(Termination::NotFinite)
        }
    }

    /// Normal forces (heel, toe) of the supporting and the free foot [N].
    pub fn loads(&self, model: &Model, mode: ContactMode) -> [[f64; 2]; 2] {
        loads(model.sole.length(), mode, &self.solution)
    }

    /// Index of the coordinate of the free ankle, q7.
    pub const Q7: usize = coordinate(FREE_FOOT);
}
