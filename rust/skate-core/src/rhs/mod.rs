//! The right-hand side of the equations of motion: positions and velocities in, accelerations and contact
//! forces out. `Evaluation::evaluate` lists the steps.

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
        aba::{Forces, ImplicitTerms},
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
    numeric::{
        scalar::{Mask, Scalar},
        simd::with_avx2,
        vec3,
    },
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
pub struct Stance<T = f64> {
    pub pivot_to_ankle: [T; 2],
    pub ankle_to_point: T,
    /// Number of constraints of the free foot, in the lane with the most.
    pub rows: usize,
}

impl<T: Scalar> Stance<T> {
    #[inline(always)]
    pub fn of(models: impl ModelLanes<T>, mode: ContactMode) -> Self {
        let (support, free) = (mode.support.touch, mode.free.touch);
        Self {
            pivot_to_ankle: [0, 1].map(|i| models.number(|m| pivot_to_ankle(m, support)[i])),
            ankle_to_point: models.number(|m| ankle_to_point(m, free)),
            rows: rows(free),
        }
    }
}

/// What an evaluation depends on besides positions and velocities; the same contact mode in every lane.
#[derive(Debug, Clone, Copy)]
pub struct Inputs<'a, T = f64> {
    pub mode: ContactMode,
    pub slip: Slip<T>,
    pub stance: &'a Stance<T>,
    /// One per lane.
    pub now: &'a [ControllerInput],
    /// Residual torque by coordinate [N m].
    pub residual: &'a [T; NV],
}

/// Torques that are known before the feedback [N m].
#[derive(Debug, Clone, Copy)]
pub struct Torques<'a, T = f64> {
    pub feedforward: &'a [T; NV],
    pub residual: &'a [T; NV],
}

/// Lanes in which an evaluation has no result, and the cause in one of them.
#[derive(Debug, Clone, Copy)]
#[must_use]
pub struct Failed<M> {
    pub lanes: M,
    cause: Termination,
}

impl<M: Mask> Failed<M> {
    #[inline(always)]
    fn none() -> Self {
        Self {
            lanes: M::of(false),
            cause: Termination::Singular,
        }
    }
}

impl Failed<bool> {
    fn result(self) -> Result<(), Termination> {
        if self.lanes { Err(self.cause) } else { Ok(()) }
    }
}

impl<T: Scalar> Evaluation<T> {
    /// Factor M, or with `implicit` the matrix of an implicit step, and set up the contact problem's S and, for a free
    /// foot on the ice, its G and W (Eq. 12).
    #[inline(always)]
    pub fn factor(
        &mut self,
        models: impl ModelLanes<T>,
        rows: usize,
        implicit: Option<ImplicitTerms<'_, T>>,
    ) {
        self.factored
            .factor(models, &self.kin, rows, self.point, implicit);
        self.factored.problem.lever = self.levers(models);
    }

    /// `ContactProblem::lever`.
    #[inline(always)]
    pub fn levers(&self, models: impl ModelLanes<T>) -> [T; 2] {
        [0, FREE_FOOT].map(|foot| models.number(|m| m.sole.length()) * self.kin.sin_cos[foot].1)
    }

    /// Applied torques: those known, and the controller's feedback.
    #[inline(always)]
    pub fn control(
        &mut self,
        models: impl ModelLanes<T>,
        q: &[T; NV],
        v: &[T; NV],
        now: &[ControllerInput],
        known: Torques<'_, T>,
    ) {
        self.tau = *known.feedforward;
        control::add_feedback(models, &mut self.kin, (q, v), now, &mut self.tau);
        for c in 0..models.shape().n.min(NV) {
            self.tau[c] += known.residual[c];
        }
    }

    /// Reduce tau - D v_d - h(v) - g along the tree (Featherstone 2008, ch. 7): applied torques, joint friction
    /// at the velocities `damped`, inertial forces at the velocities `v`, gravity.
    #[inline(always)]
    fn reduce_forces(&mut self, models: impl ModelLanes<T>, v: &[T; NV], damped: &[T; NV]) {
        let model = models.shape();
        self.reduced = self.tau;
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

    /// Accelerations and contact forces (Eq. 13), for scalars as for lanes.
    #[inline(always)]
    pub fn evaluate(
        &mut self,
        models: impl ModelLanes<T>,
        (q, v): (&[T; NV], &[T; NV]),
        inputs: &Inputs<'_, T>,
    ) -> Failed<T::Mask> {
        let torques = Torques {
            feedforward: &control::open_loop_torques(models, inputs.now),
            residual: inputs.residual,
        };
        self.update_kinematics(models, inputs.stance, q, v);
        self.factor(models, inputs.stance.rows, None);
        self.load(models, (q, v), inputs.now, torques);
        let mut failed = self.solve_contacts(inputs.mode, inputs.slip);
        if failed.lanes.all() {
            return failed;
        }
        // The contact point of a foot in the air was not computed.
        self.solution.a_free = match inputs.mode.free.touch {
            SoleContact::Air => vec3::zero(),
            _ => self.factored.problem.free_motion(&self.solution),
        };
        self.back_substitute(models);
        let finite = self.finite_lanes(models.shape());
        if !finite.all() {
            failed.lanes = failed.lanes | !finite;
            failed.cause = Termination::NotFinite;
        }
        failed
    }

    /// Loads of the contact problem at (q, v), after `factor`.
    #[inline(always)]
    pub fn load(
        &mut self,
        models: impl ModelLanes<T>,
        (q, v): (&[T; NV], &[T; NV]),
        now: &[ControllerInput],
        known: Torques<'_, T>,
    ) {
        self.control(models, q, v, now, known);
        self.reduce_forces(models, v, v);
        self.set_contact_loads(models.shape());
    }

    /// Motion of the supporting foot and contact forces.
    #[inline(always)]
    fn solve_contacts(&mut self, mode: ContactMode, slip: Slip<T>) -> Failed<T::Mask> {
        let (solution, regular) = self.factored.problem.regular_forces(mode, slip);
        self.solution = solution;
        if regular.all() {
            return Failed::none();
        }
        self.solve_dependent(mode, &slip, !regular)
    }

    /// The same in the lanes where the contact mode does not determine them uniquely.
    #[inline(never)]
    fn solve_dependent(
        &mut self,
        mode: ContactMode,
        slip: &Slip<T>,
        lanes: T::Mask,
    ) -> Failed<T::Mask> {
        let mut failed = Failed::none();
        for i in (0..T::LANES).filter(|&i| lanes.lane(i)) {
            let slip = Slip {
                support: slip.support.lane(i),
                free: slip.free.lane(i),
            };
            match self.factored.problem.lane(i).solve_dependent(mode, slip) {
                Ok(solution) => self.solution.set_lane(i, &solution),
                Err(cause) => {
                    failed.lanes = failed.lanes | T::Mask::only(i);
                    failed.cause = cause;
                }
            }
        }
        failed
    }

    /// Lanes in which all accelerations are finite.
    #[inline(always)]
    fn finite_lanes(&self, model: &Model) -> T::Mask {
        // The sum of a * 0 is zero only if every a is finite.
        let mut sum = T::zero();
        for a in &self.qdd[..model.n.min(NV)] {
            sum += *a * T::zero();
        }
        sum.abs().le(T::zero())
    }

    /// q'' from the motion of the root and the forces on the free foot.
    #[inline(always)]
    pub fn back_substitute(&mut self, models: impl ModelLanes<T>) {
        self.qdd = self.reduced;
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
        let failed = with_avx2(
            #[inline(always)]
            || {
                let inputs = Inputs {
                    mode: context.mode,
                    slip: context.slip,
                    stance: &Stance::of(model, context.mode),
                    now: std::slice::from_ref(&context.now),
                    residual: &context.residual,
                };
                self.evaluate(model, (q, v), &inputs)
            },
        );
        failed.result()
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
        let now = std::slice::from_ref(&context.now);
        let torques = Torques {
            feedforward: &control::open_loop_torques(model, now),
            residual: &context.residual,
        };
        self.load(model, (q, v), now, torques);
    }

    /// Normal forces (heel, toe) of the supporting and the free foot [N].
    pub fn loads(&self, model: &Model, mode: ContactMode) -> [[f64; 2]; 2] {
        loads(self.levers(model), mode, &self.solution)
    }

    /// Index of the coordinate of the free ankle, q7.
    pub const Q7: usize = coordinate(FREE_FOOT);
}
