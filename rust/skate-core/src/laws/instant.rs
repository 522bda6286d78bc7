//! Positions, energy and momenta of the robot at one instant.

use crate::{
    dynamics::bias_forces::energy,
    model::{
        Model,
        contact_mode::End,
        layout::{FREE_FOOT, FREE_LOWER_LEG, LOWER_LEG, UPPER_LEG, WAIST},
        state::State,
    },
    numeric::elementary::hypot,
    rhs::Evaluation,
    scene::Leg,
};
use nalgebra::Vector3;

/// Head, waist, and of each leg knee, ankle, heel and toe.
pub const POINTS: usize = 10;

/// See the module's documentation.
#[derive(Debug, Clone, Copy)]
pub struct Instant {
    pub state: State,
    /// Kinetic plus potential energy [J].
    pub energy: f64,
    /// Linear momentum along y and z [kg m/s].
    pub momentum: [f64; 2],
    /// Angular momentum about the centre of mass [kg m2/s].
    pub spin: f64,
    /// Points in the world, y and z [m]; the right leg comes first.
    pub points: [[f64; 2]; POINTS],
    /// Their velocities [m/s].
    pub velocities: [[f64; 2]; POINTS],
}

impl Instant {
    /// At a state; `eval` is a workspace.
    pub fn of(model: &Model, eval: &mut Evaluation, state: &State) -> Self {
        let State { q, v, mode, .. } = state;
        eval.full_kinematics(model, mode.support.touch, q, v);
        let kin = &eval.kin;
        let (kinetic, potential) = energy(model, kin, v, q[1]);
        let (momentum, about_pivot) = eval.inertias.momentum(model, kin);
        let moments = model.bodies.iter().enumerate();
        let moment: Vector3<f64> = moments
            .map(|(b, body)| kin.point(model, b, &body.com) * body.mass)
            .sum();
        let com = moment / model.mass();
        let mut places = [(0, Vector3::zeros()); POINTS];
        places[0] = (model.head.0, kin.head(model));
        places[1] = (WAIST, kin.p[WAIST]);
        // The supporting leg takes its place by its side.
        let support = 2 + 4 * usize::from(state.support_leg == Leg::Left);
        let legs = [
            (support, [UPPER_LEG, LOWER_LEG, 0]),
            (8 - support, [FREE_LOWER_LEG, FREE_FOOT, FREE_FOOT]),
        ];
        for (at, [shank, foot, sole]) in legs {
            places[at] = (shank, kin.p[shank]);
            places[at + 1] = (foot, kin.p[foot]);
            for (i, end) in [End::Heel, End::Toe].into_iter().enumerate() {
                let p = kin.sole_point_of(model, sole, model.sole.ahead_of_ankle(end));
                places[at + 2 + i] = (sole, Vector3::new(0.0, p.y, p.z));
            }
        }
        Self {
            state: *state,
            energy: kinetic + potential,
            momentum,
            spin: about_pivot - (com.y * momentum[1] - com.z * momentum[0]),
            points: places.map(|(_, p)| [q[0] + p.y, q[1] + p.z]),
            velocities: places.map(|(body, p)| {
                let velocity = kin.point_velocity(body, &p);
                [velocity.y, velocity.z]
            }),
        }
    }

    /// Largest distance of a point from its place at another instant [m].
    pub fn distance(&self, other: &Self) -> f64 {
        largest_difference(&self.points, &other.points)
    }

    /// Largest difference of a point's velocity [m/s].
    pub fn velocity_difference(&self, other: &Self) -> f64 {
        largest_difference(&self.velocities, &other.velocities)
    }

    /// Change of the momenta since another instant that gravity does not explain, as a velocity [m/s].
    pub fn unexplained_momentum(&self, model: &Model, start: &Self) -> f64 {
        let mass = model.mass();
        let fallen = mass * model.scene.ice.gravity * (self.state.t - start.state.t);
        let changes = [
            self.momentum[0] - start.momentum[0],
            self.momentum[1] - start.momentum[1] + fallen,
            self.spin - start.spin,
        ];
        changes
            .iter()
            .fold(0.0, |so_far: f64, x| so_far.max(x.abs()))
            / mass
    }
}

fn largest_difference(a: &[[f64; 2]; POINTS], b: &[[f64; 2]; POINTS]) -> f64 {
    let pairs = a.iter().zip(b);
    pairs
        .map(|(a, b)| hypot(a[0] - b[0], a[1] - b[1]))
        .fold(0.0, f64::max)
}
