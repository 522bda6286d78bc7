//! One Moreau time step, for one robot or for one robot per lane. Numbers in comments are those of the algorithm in
//! the documentation of `time_stepping`.

use crate::{
    contact::equations::{PHI, Solution, Y, Z},
    control::{
        ControllerInput,
        feedforward::{AnkleMotion, add_tau7_correction},
        head_force::{Feedback, feedback},
        joint_torques::Slopes,
        open_loop_torques,
    },
    dynamics::{aba::ImplicitTerms, centre_of_mass::InnerMotion},
    model::{
        lanes::ModelLanes,
        layout::{FREE_FOOT, LEG, NV, ROOT, coordinate},
        state::FASTEST,
    },
    numeric::{
        scalar::{Mask, Scalar},
        vec3,
    },
    rhs::{Evaluation, Stance, Torques, projection::PositionConstraints, sole_points::SolePoints},
    time_stepping::{
        momentum::{Motion, Restored},
        step_contacts::StepContacts,
        step_length::{MAX_ROTATION, SHORTEST},
    },
};

/// Tolerated violation of the free foot's constraints [m, rad]: 1e-4 of the tolerance of a landing.
const POSITION_TOLERANCE: f64 = 1e-9;
/// Iterations for the new velocities. The first uses the old velocities, the second the mean of old and new ones.
const ITERATIONS: usize = 2;
/// Number of coordinates of the pivot, y0 and z0.
const PIVOT: usize = 2;

/// Input, workspace and result of a step.
#[derive(Debug, Clone, Default)]
pub struct MoreauStep<T: Scalar> {
    pub start: Motion<T>,
    /// Length [s].
    pub h: T,
    /// Residual torques, constant over the step [N m].
    pub residual: [T; NV],
    /// Linearised forces on the head.
    pub feedback: Feedback<T>,
    pub end: Motion<T>,
    /// Forces and accelerations, as means over the step.
    pub forces: Solution<T>,
    /// Sole points at the end.
    pub sole_points: SolePoints<T>,
}

/// Make a step. `stance` is the geometry of the contacts, `now` the controller's input at the middle of the step, one
/// per lane. Returns false if the step is void in all lanes. `contacts` has the reason, and the lanes in which it is
/// void although others have been stepped.
#[inline(always)]
pub fn moreau_step<T: Scalar, R: ModelLanes<T>>(
    eval: &mut Evaluation<T>,
    contacts: &mut StepContacts<'_, T, R>,
    step: &mut MoreauStep<T>,
    stance: &Stance<T>,
    now: &[ControllerInput],
) -> bool {
    let MoreauStep {
        start,
        h,
        residual,
        feedback: head,
        end,
        ..
    } = step;
    let (start, h) = (&*start, *h);
    let models = contacts.models;
    let model = models.shape();
    let n = model.n.min(NV);
    let half = T::of(0.5) * h;
    let Motion { q, v, .. } = end;
    // 1. Midpoint.
    for c in 0..n {
        q[c] = start.q[c] + half * start.v[c];
    }
    eval.update_kinematics(models, stance, q, &start.v);
    // 2. M + h/2 D.
    let slopes = Slopes::of(models, &eval.kin, (q, &start.v), now);
    let mut legs = [T::zero(); NV];
    if let Some(slopes) = &slopes {
        legs = slopes.implicit_part(half);
    }
    let terms = ImplicitTerms {
        g: half,
        legs: &legs,
    };
    eval.factor(models, stance.rows, Some(terms));
    // 3. + J^T (h/2 D_h + h^2/4 K_p) J.
    let implicit_head = feedback(models, &eval.kin, now, head);
    if implicit_head {
        let Feedback { K, D, J } = &*head;
        let stiffness = vec3::scale(&vec3::add(D, &vec3::scale(K, half)), half);
        let regular = eval.factored.add_stiffness(models, J, stiffness);
        contacts.stop_singular(regular);
    }
    // 4. Open-loop torques.
    let mut feedforward = open_loop_torques(models, now);
    let (mut means, mut solution) = ([T::zero(); NV], Solution::default());
    v[..n].copy_from_slice(&start.v[..n]);
    for iteration in 0..ITERATIONS {
        let mut mean = &start.v;
        if iteration > 0 {
            for c in 0..n {
                means[c] = T::of(0.5) * (start.v[c] + v[c]);
            }
            mean = &means;
            eval.kin.planar_velocities(model, mean);
            let ankle = AnkleMotion {
                h,
                angle: eval.kin.angle[FREE_FOOT],
                rates: [foot_rate(&start.v), foot_rate(v)],
                inverse: eval.factored.tree.inverse_d(coordinate(FREE_FOOT)),
            };
            add_tau7_correction(models, now, &ankle, &mut feedforward);
        }
        // 5. All torques.
        let torques = Torques {
            feedforward: &feedforward,
            residual,
        };
        eval.control(models, q, mean, now, torques);
        if implicit_head {
            subtract_implicit_damping(models, head, (&start.v, v), &mut eval.tau);
        }
        if let Some(slopes) = &slopes {
            slopes.subtract_implicit_part((&start.v, v), half, &eval.kin, &mut eval.tau);
        }
        // 6. Contact problem.
        eval.assemble_impulse_problem(models, (&start.v, mean), h);
        // 7. Contact modes and impulses.
        loop {
            solution = match contacts.solve_impulses(&eval.factored.problem) {
                Some(solution) => solution,
                None => return false,
            };
            let old = [start.v[Y], eval.point_velocity[Y] - eval.drift[Y]];
            let new = [solution.a_root[Y], solution.a_free[Y]];
            let is_last = iteration + 1 == ITERATIONS;
            if !is_last || !contacts.drop_driving_friction(&solution, (old, new), h) {
                break;
            }
        }
        // 8. New velocities.
        let change = eval.velocity_change(models, &start.v, &solution);
        for c in 0..n {
            v[c] = start.v[c] + change[c];
        }
        for i in 0..ROOT {
            v[i] = solution.a_root[i];
        }
    }
    let largest = T::select(
        h.le(T::of(SHORTEST)),
        T::of(FASTEST),
        T::of(MAX_ROTATION) / h,
    );
    let mut bounded = T::Mask::of(true);
    for (c, v) in v[..n].iter().enumerate() {
        // The pivot may move at any speed: the motion relative to it is the same.
        let largest = if c < PIVOT { T::of(FASTEST) } else { largest };
        bounded = bounded & v.abs().le(largest);
    }
    contacts.stop_unbounded(bounded);
    // 9. New positions, and energies.
    for c in 0..n {
        q[c] += half * v[c];
    }
    // An impact at the start may have left the supporting foot with a velocity away from the ice.
    q[1] = T::select(contacts.supported(), T::zero(), q[1]);
    (end.anchor, end.energies) = (start.anchor, start.energies);
    if model.scene.energy_balance {
        if let Some(slopes) = &slopes {
            slopes.add_implicit_part((&start.v, v), half, &mut eval.tau);
        }
        let at_rest = contacts.free_foot_rests();
        accumulate_energy(models, eval, (start, h), (&solution, at_rest), end);
    }
    // 10. Projection, and kinematics at the end.
    eval.update_leg_kinematics(models, stance, &end.q);
    if stance.rows > 0 {
        end.anchor = T::select(contacts.newly_stuck(), end.q[0] + eval.point.y, end.anchor);
        let constraints = PositionConstraints {
            held: contacts.held(),
            anchor: end.anchor,
            tolerance: T::of(POSITION_TOLERANCE),
        };
        let active = contacts.touching();
        constraints.project(
            eval,
            (models, stance),
            &mut end.q,
            active,
            // Outside the function for wide registers it would be compiled for narrow ones.
            #[inline(always)]
            |problem| (contacts.solve_correction(problem), contacts.touching()),
        );
    }
    // 11. Momentum, and kinematics at the end.
    let lanes = Restored {
        along: contacts.sticking_nowhere(),
        all: contacts.in_flight(),
    };
    let in_flight = lanes.all.any();
    eval.kin.trunk_and_limbs(models, &end.q, in_flight);
    let inner = InnerMotion::of(models, &eval.kin, &end.v, in_flight);
    if lanes.along.any() {
        let tau = [Y, Z, PHI].map(|i| feedforward[i] + residual[i]);
        end.restore_momentum(models, (&inner, lanes), (start, h), (tau, &solution));
    }
    end.centre = inner.with_root(&end.v);
    eval.kin.planar_velocities(model, &end.v);
    step.forces = mean_forces(&solution, &start.v, h);
    step.sole_points = SolePoints::of(models, &eval.kin, contacts.on_heel(), step.end.q[1]);
    step.sole_points.centre = step.end.centre;
    true
}

/// The matrix applies the head's damping to the change of the velocities, from `old` to `new`. The torques, computed
/// with the mean velocities, must contain the damping of the old velocities only.
#[inline(always)]
fn subtract_implicit_damping<T: Scalar>(
    models: impl ModelLanes<T>,
    Feedback { D, J, .. }: &Feedback<T>,
    (old, new): (&[T; NV], &[T; NV]),
    tau: &mut [T; NV],
) {
    let model = models.shape();
    // q1 moves the head, too.
    const Q1: usize = ROOT - 1;
    for i in 0..3 {
        let mut change = J[i][Q1] * (new[Q1] - old[Q1]);
        for &c in &model.head_path {
            change += J[i][c] * (new[c] - old[c]);
        }
        tau[Q1] += J[i][Q1] * T::of(0.5) * D[i] * change;
        for &c in &model.head_path {
            tau[c] += J[i][c] * T::of(0.5) * D[i] * change;
        }
    }
}

/// Angular velocity of the free foot: the sum of the rates of q1 and q2 to q7.
#[inline(always)]
fn foot_rate<T: Scalar>(v: &[T; NV]) -> T {
    let mut rate = v[ROOT - 1];
    for &joint in &v[ROOT..LEG] {
        rate += joint;
    }
    rate
}

/// Add the energies of a step. Forces act along the mean of old and new velocities.
#[inline(always)]
fn accumulate_energy<T: Scalar>(
    models: impl ModelLanes<T>,
    eval: &Evaluation<T>,
    (start, h): (&Motion<T>, T),
    (solution, free_foot_rests): (&Solution<T>, T::Mask),
    end: &mut Motion<T>,
) {
    let half = T::of(0.5);
    let [actuators, damping, friction] = &mut end.energies;
    for c in 0..models.shape().n.min(NV) {
        let mean = half * (start.v[c] + end.v[c]);
        *actuators += h * eval.tau[c] * mean;
        *damping += h * models.number(|m| m.damping[c]) * mean * mean;
    }
    // D includes the viscous friction of the ice.
    let mean = half * (start.v[Y] + end.v[Y]);
    let viscous = h * models.number(|m| m.damping[Y]) * mean * mean;
    *damping -= viscous;
    *friction += viscous - solution.f_root[Y] * mean;
    let foot = half * (eval.point_velocity[Y] + solution.a_free[Y] - eval.drift[Y]);
    *friction -= T::select(free_foot_rests, T::zero(), solution.lam[Y] * foot);
}

/// Mean forces and accelerations from impulses and new velocities; `v` are the old velocities.
#[inline(always)]
fn mean_forces<T: Scalar>(solution: &Solution<T>, v: &[T; NV], h: T) -> Solution<T> {
    let mut means = Solution::default();
    for i in 0..3 {
        means.a_root[i] = (solution.a_root[i] - v[i]) / h;
        means.f_root[i] = solution.f_root[i] / h;
        means.lam[i] = solution.lam[i] / h;
    }
    means
}
