//! The motion over one step, whatever the contacts do in it: of one robot, or of one in every lane.

use crate::{
    contact::equations::{Solution, Y},
    control::{
        ControllerInput, add_tau7_correction,
        feedforward::AnkleMotion,
        lifting::{Feedback, feedback},
        open_loop_torques,
    },
    model::{
        lanes::ModelLanes,
        layout::{FREE_FOOT, LEG, NV, ROOT, coordinate},
        state::FASTEST,
    },
    numeric::{
        scalar::{Mask, Scalar},
        vec3,
    },
    rhs::{Evaluation, Stance, projection::PositionConstraints, sole_points::SolePoints},
    sim::moreau::step_contacts::StepContacts,
};

/// Violations of the free foot's position that are left alone [m, rad]: a ten-thousandth of what a landing is
/// located to.
const POSITION: f64 = 1e-9;
/// Solutions for the new velocities: the second knows their mean.
const PASSES: usize = 2;

/// Where a step begins, and where it ends.
#[derive(Debug, Clone, Copy)]
pub struct Motion<T> {
    pub q: [T; NV],
    pub v: [T; NV],
    /// Where a free foot that sticks does so [m].
    pub anchor: T,
    /// Work of the actuators, taken by damping and by friction [J]; see `EnergyBalance`.
    pub energies: [T; 3],
}

/// Input and result of a step.
#[derive(Debug, Clone, Default)]
pub struct MoreauStep<T: Scalar> {
    pub start: Motion<T>,
    /// Its length [s].
    pub h: T,
    /// Torques held [N m].
    pub residual: [T; NV],
    /// How the forces on the head answer.
    pub feedback: Feedback<T>,
    pub end: Motion<T>,
    /// Mean forces and accelerations.
    pub forces: Solution<T>,
    pub sole_points: SolePoints<T>,
}

impl<T: Scalar> Default for Motion<T> {
    fn default() -> Self {
        Self {
            q: [T::zero(); NV],
            v: [T::zero(); NV],
            anchor: T::zero(),
            energies: [T::zero(); 3],
        }
    }
}

/// Make a step. `stance` says how the feet stand, `now` what the controller sees in the middle of it. False
/// where nothing has moved in any lane; `feet` knows why, and in which lanes that may be so even if others
/// have.
#[inline(always)]
pub fn glide<T: Scalar, R: ModelLanes<T>>(
    eval: &mut Evaluation<T>,
    feet: &mut StepContacts<'_, T, R>,
    step: &mut MoreauStep<T>,
    stance: &Stance<T>,
    now: &[ControllerInput],
) -> bool {
    let MoreauStep {
        start,
        h,
        residual,
        feedback: springs,
        end,
        ..
    } = step;
    let (start, h) = (&*start, *h);
    let models = feet.models;
    let model = models.shape();
    let n = model.n.min(NV);
    let half = T::of(0.5) * h;
    let Motion { q, v, .. } = end;
    for c in 0..n {
        q[c] = start.q[c] + half * start.v[c];
    }
    eval.update_kinematics(models, stance, q, &start.v);
    eval.factor(models, stance.rows, Some(half));
    let springy = feedback(models, &eval.kin, now, springs);
    let Feedback { K, D, J } = &*springs;
    if springy {
        let kappa = vec3::scale(&vec3::add(D, &vec3::scale(K, half)), half);
        let regular = eval.factored.add_stiffness(models, J, kappa);
        feet.require(regular);
    }
    let mut printed = open_loop_torques(models, now);
    let (mut means, mut solution) = ([T::zero(); NV], Solution::default());
    v[..n].copy_from_slice(&start.v[..n]);
    for pass in 0..PASSES {
        let mut mean = &start.v;
        if pass > 0 {
            for c in 0..n {
                means[c] = T::of(0.5) * (start.v[c] + v[c]);
            }
            mean = &means;
            eval.kin.planar_velocities(model, mean);
            let turning = AnkleMotion {
                h,
                angle: eval.kin.angle[FREE_FOOT],
                rates: [foot_rate(&start.v), foot_rate(v)],
                inverse: eval.factored.tree.inverse_d(coordinate(FREE_FOOT)),
            };
            add_tau7_correction(models, now, &turning, &mut printed);
        }
        eval.control(models, q, mean, now, (&printed, residual));
        if springy {
            // The torques know the last pass's velocities, the springs count from the start's.
            for i in 0..3 {
                // The foot's rotation moves the head, too.
                let mut moved = J[i][ROOT - 1] * (v[ROOT - 1] - start.v[ROOT - 1]);
                for &c in &model.head_path {
                    moved += J[i][c] * (v[c] - start.v[c]);
                }
                eval.tau[ROOT - 1] += J[i][ROOT - 1] * T::of(0.5) * D[i] * moved;
                for &c in &model.head_path {
                    eval.tau[c] += J[i][c] * T::of(0.5) * D[i] * moved;
                }
            }
        }
        eval.assemble_impulse_problem(models, (&start.v, mean), h);
        solution = match feet.impulses(&eval.factored.problem) {
            Some(solution) => solution,
            None => return false,
        };
        let change = eval.velocity_change(models, &start.v, &solution);
        for c in 0..n {
            v[c] = start.v[c] + change[c];
        }
        for i in 0..ROOT {
            v[i] = solution.a_root[i];
        }
    }
    let mut bounded = T::Mask::of(true);
    for v in &v[..n] {
        bounded = bounded & v.abs().le(T::of(FASTEST));
    }
    feet.bound(bounded);
    for c in 0..n {
        q[c] += half * v[c];
    }
    (end.anchor, end.energies) = (start.anchor, start.energies);
    if model.scene.energy_balance {
        book(models, eval, (start, h), &solution, end);
    }
    eval.update_leg_kinematics(models, stance, &end.q);
    if stance.rows > 0 {
        end.anchor = T::select(feet.newly_stuck(), end.q[0] + eval.point.y, end.anchor);
        let constraints = PositionConstraints {
            held: feet.held(),
            anchor: end.anchor,
            tolerance: T::of(POSITION),
        };
        let touching = feet.touching();
        let projected =
            constraints.project(eval, (models, stance), &mut end.q, touching, |problem| {
                Ok((feet.correction(problem), feet.touching()))
            });
        debug_assert!(projected.is_ok(), "`correction` records errors by lane");
    }
    eval.update_trunk_kinematics(models, &end.q, &end.v);
    step.forces = forces(&solution, &start.v, h);
    step.sole_points = SolePoints::of(models, &eval.kin, feet.on_heel(), step.end.q[1]);
    true
}

/// At which the free foot turns to the ice: q1 and q2 to q7.
#[inline(always)]
fn foot_rate<T: Scalar>(v: &[T; NV]) -> T {
    let mut rate = v[ROOT - 1];
    for &joint in &v[ROOT..LEG] {
        rate += joint;
    }
    rate
}

/// Energy of a step: forces act along the mean of old and new velocities.
#[inline(always)]
fn book<T: Scalar>(
    models: impl ModelLanes<T>,
    eval: &Evaluation<T>,
    (start, h): (&Motion<T>, T),
    solution: &Solution<T>,
    end: &mut Motion<T>,
) {
    let half = T::of(0.5);
    let [actuators, damping, friction] = &mut end.energies;
    for c in 0..models.shape().n.min(NV) {
        let mean = half * (start.v[c] + end.v[c]);
        *actuators += h * eval.tau[c] * mean;
        *damping += h * models.number(|m| m.damping[c]) * mean * mean;
    }
    // D holds the ice's viscous friction, too.
    let mean = half * (start.v[Y] + end.v[Y]);
    let rubbed = h * models.number(|m| m.damping[Y]) * mean * mean;
    *damping -= rubbed;
    *friction += rubbed - solution.f_root[Y] * mean;
    let foot = half * (eval.point_velocity[Y] + solution.a_free[Y] - eval.drift[Y]);
    *friction -= solution.lam[Y] * foot;
}

/// Impulses as mean forces over a step that began with the velocities `v`.
#[inline(always)]
fn forces<T: Scalar>(solution: &Solution<T>, v: &[T; NV], h: T) -> Solution<T> {
    let mut means = Solution::default();
    for i in 0..3 {
        means.a_root[i] = (solution.a_root[i] - v[i]) / h;
        means.f_root[i] = solution.f_root[i] / h;
        means.lam[i] = solution.lam[i] / h;
    }
    means
}
