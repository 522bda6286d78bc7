//! Projection onto the constraints of the free foot (Eq. 10) in the metric of M: positions, then velocities
//! (Eich 1993). The supporting foot needs none: its constrained coordinates are not integrated.

use crate::{
    contact::equations::{ContactProblem, PHI, Slip, Solution, Y},
    error::Termination,
    model::{
        Model,
        contact_mode::{ContactMode, Foot, SoleContact},
        lanes::ModelLanes,
        layout::{FREE_FOOT, NV},
        state::State,
    },
    numeric::{
        scalar::{Mask, Scalar},
        trig::nearest_half_turn,
        vec3,
    },
    rhs::{Evaluation, Stance},
};
use nalgebra::Vector3;

/// Violations that are not corrected [m, rad], [m/s, rad/s].
const POSITION: f64 = 1e-12;
const VELOCITY: f64 = 1e-11;
/// Most corrections of the positions. The factor of M stays: each correction multiplies the violation by about
/// the first one.
const MAX_ITERATIONS: usize = 8;
/// Iterations that derivatives need: each leaves about the change of the positions of what the one before has left.
const FOR_DERIVATIVES: usize = 6;

/// Position constraints of a free foot on the ice.
#[derive(Debug, Clone, Copy)]
pub struct PositionConstraints<T = f64> {
    /// 1 for each of y, z, rotation that is constrained, else 0.
    pub held: [T; 3],
    /// y at which a free foot that sticks does so [m].
    pub anchor: T,
    /// Violation that is not corrected [m, rad].
    pub tolerance: T,
}

impl<T: Scalar> PositionConstraints<T> {
    /// Those of a mode, to rounding.
    #[inline(always)]
    pub fn of(free: Foot, anchor: T) -> Self {
        let one_if = |holds: bool| if holds { T::one() } else { T::zero() };
        Self {
            held: [
                one_if(!free.slides()),
                T::one(),
                one_if(free.touch == SoleContact::Flat),
            ],
            anchor,
            tolerance: T::of(POSITION),
        }
    }

    /// C(q) for y, z and rotation; zero where there is no constraint.
    #[inline(always)]
    fn violation(&self, eval: &Evaluation<T>, q: &[T; NV]) -> Vector3<T> {
        let mut angle = eval.kin.angle[FREE_FOOT];
        if !angle.abs().le(T::one()).all() {
            angle -= nearest_half_turn(angle);
        }
        Vector3::new(
            self.held[Y] * (q[0] + eval.point.y - self.anchor),
            q[1] + eval.point.z,
            self.held[PHI] * angle,
        )
    }

    /// Project `q` in the lanes of `active`; returns whether anything moved. `solve` gives the motion of the
    /// root and the impulses that remove the violation `alpha0` of a problem, and the lanes in which they exist;
    /// the others are not corrected further. Positions from which corrections lead away stay as they are: a leg that is
    /// almost straight cannot become longer.
    #[inline(always)]
    pub fn project(
        &self,
        eval: &mut Evaluation<T>,
        (models, stance): (impl ModelLanes<T>, &Stance<T>),
        q: &mut [T; NV],
        mut active: T::Mask,
        mut solve: impl FnMut(&ContactProblem<T>) -> (Solution<T>, T::Mask),
    ) -> bool {
        let largest_of = |x: &Vector3<T>| x.z.abs().simd_max(x.y.abs().simd_max(x.x.abs()));
        let n = models.shape().n.min(NV);
        let (start, mut first) = (*q, T::zero());
        let mut moved = T::Mask::of(false);
        for iteration in 0..MAX_ITERATIONS {
            let violation = self.violation(eval, q);
            let largest = largest_of(&violation);
            if iteration == 0 {
                first = largest;
            }
            // Derivatives converge even where the values have: the factor belongs to other positions.
            let converges = T::Mask::of(T::HAS_DERIVATIVES && iteration < FOR_DERIVATIVES);
            let moves = active & (!largest.le(self.tolerance) | converges);
            if !moves.any() {
                return moved.any();
            }
            let problem = eval.factored.problem.with_loads(vec3::zero(), violation);
            let (Solution { a_root, lam, .. }, exists) = solve(&problem);
            active = active & exists;
            let step = eval.response(models, &a_root, &lam);
            moved = moved | moves;
            for c in 0..n {
                q[c] = T::select(moves, q[c] + step[c], q[c]);
            }
            eval.update_leg_kinematics(models, stance, q);
        }
        // The corrections have not converged.
        let diverges = moved & !largest_of(&self.violation(eval, q)).le(first);
        for c in 0..n {
            q[c] = T::select(diverges, start[c], q[c]);
        }
        eval.update_leg_kinematics(models, stance, q);
        (moved & !diverges).any()
    }
}

/// Violation of the free foot's constraints (y, z, rotation), of positions and of velocities. `eval` contains
/// the contact point.
pub fn violation(eval: &Evaluation, state: &State) -> (Vector3<f64>, Vector3<f64>) {
    violation_of(eval, &state.q, (state.mode.free, state.anchor))
}

#[inline(always)]
fn violation_of<T: Scalar>(
    eval: &Evaluation<T>,
    q: &[T; NV],
    (free, anchor): (Foot, T),
) -> (Vector3<T>, Vector3<T>) {
    let constraints = PositionConstraints::of(free, anchor);
    let [y, z, phi] = eval.point_velocity;
    let velocity = Vector3::new(constraints.held[Y] * y, z, constraints.held[PHI] * phi);
    (constraints.violation(eval, q), velocity)
}

/// Where `project` would move positions or velocities.
#[inline(always)]
pub fn is_violated<T: Scalar>(
    eval: &Evaluation<T>,
    q: &[T; NV],
    (free, anchor): (Foot, T),
) -> T::Mask {
    if free.touch == SoleContact::Air {
        return T::Mask::of(false);
    }
    let (position, velocity) = violation_of(eval, q, (free, anchor));
    let is_small = |x: &Vector3<T>, limit: f64| {
        let limit = T::of(limit);
        x.x.abs().le(limit) & x.y.abs().le(limit) & x.z.abs().le(limit)
    };
    !(is_small(&position, POSITION) & is_small(&velocity, VELOCITY))
}

/// Project positions and velocities; returns whether anything moved. `eval` is assembled for the state; after a
/// movement it must be evaluated again.
///
/// # Errors
/// `Singular` or `NotFinite`, see `ContactProblem::solve`.
pub fn project(
    model: &Model,
    eval: &mut Evaluation,
    state: &mut State,
) -> Result<bool, Termination> {
    if state.mode.free.touch == SoleContact::Air {
        return Ok(false);
    }
    let mut moved = project_positions(model, eval, state)?;
    let (_, velocity) = violation(eval, state);
    if velocity.amax() > VELOCITY {
        moved = true;
        let problem = &eval.factored.problem;
        let problem = problem.with_loads(Vector3::zeros(), velocity);
        let Solution { a_root, lam, .. } = problem.solve(state.mode, Slip::default())?;
        let step = eval.response(model, &a_root, &lam);
        for c in 0..model.n {
            state.v[c] += step[c];
        }
    }
    Ok(moved)
}

/// Do the positions satisfy the free foot's constraints? `eval` contains the contact point.
pub fn is_on_ice(eval: &Evaluation, state: &State) -> bool {
    violation(eval, state).0.amax() <= POSITION
}

/// Project the positions alone, as at the instant of an impact; the free foot is on the ice.
///
/// # Errors
/// As for `project`.
pub fn project_positions(
    model: &Model,
    eval: &mut Evaluation,
    state: &mut State,
) -> Result<bool, Termination> {
    let mode: ContactMode = state.mode;
    let constraints = PositionConstraints::of(mode.free, state.anchor);
    let stance = Stance::of(model, mode);
    let mut result = Ok(());
    let moved =
        constraints.project(
            eval,
            (model, &stance),
            &mut state.q,
            true,
            |problem| match problem.solve(mode, Slip::default()) {
                Ok(solution) => (solution, true),
                Err(cause) => {
                    result = Err(cause);
                    (Solution::default(), false)
                }
            },
        );
    result?;
    if moved {
        eval.set_velocities(model, mode, &state.v);
    }
    Ok(moved)
}
