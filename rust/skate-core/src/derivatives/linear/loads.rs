//! Derivatives of the forces on the joints by everything that the accelerations depend on, for constant
//! accelerations and contact forces.

use crate::{
    contact::equations::{Solution, Y, Z},
    control::{
        ControllerInput, OpenLoop,
        feedforward::start_of,
        head_force,
        joint::{HIP, JointInput, PITCH},
        joint_torques::each_torque,
    },
    derivatives::linear::inputs::{COLUMNS, Rows, position, times, torque, velocity},
    dynamics::{
        kinematics::{Kinematics, PlanarPoint},
        rnea_derivatives::RneaDerivatives,
    },
    model::{
        Model,
        lanes::Broadcast,
        layout::{FREE_FOOT, LEG, NV, ROOT},
    },
    numeric::dual::Dual,
    rhs::Evaluation,
};

/// See the module's documentation.
#[derive(Debug, Clone)]
pub struct Loads {
    pub rows: Rows,
    /// Acceleration of the free foot's contact point, y and z.
    pub point: [[f64; COLUMNS]; 2],
}

impl Default for Loads {
    fn default() -> Self {
        Self {
            rows: [[0.0; COLUMNS]; NV],
            point: [[0.0; COLUMNS]; 2],
        }
    }
}

impl Loads {
    /// Derivatives at a state whose accelerations `qdd` and contact forces are known. `eval` has the kinematics of
    /// all bodies; `has_contact`, whether the free foot is on the ice.
    pub fn update(
        &mut self,
        model: &Model,
        (eval, rnea): (&Evaluation, &mut RneaDerivatives),
        (q, v, qdd): (&[f64; NV], &[f64; NV], &[f64; NV]),
        now: &ControllerInput,
        contact: Option<&Solution>,
    ) {
        let n = model.n.min(NV);
        let gravity = model.scene.ice.gravity;
        rnea.update(model, (&eval.kin, &eval.inertias), (v, qdd, gravity));
        for row in &mut self.rows[..n] {
            *row = [0.0; COLUMNS];
        }
        add_feedback(model, (&eval.kin, rnea), (q, v), now, &mut self.rows);
        for i in 0..n {
            let row = &mut self.rows[i];
            let (positions, rest) = row.split_at_mut(n - 1);
            for (entry, by_q) in positions.iter_mut().zip(&rnea.by_q[i][1..n]) {
                *entry -= by_q;
            }
            for (entry, by_v) in rest.iter_mut().zip(&rnea.by_v[i][..n]) {
                *entry -= by_v;
            }
            if model.damped.contains(&i) {
                row[velocity(n, i)] -= model.damping[i];
            }
            if i >= ROOT {
                row[torque(n, i)] = 1.0;
            }
        }
        if let Some(solution) = contact {
            self.add_contact(n, (&eval.kin, eval), qdd, solution);
        }
    }

    /// Torques of the force on the free foot, and the acceleration of its contact point. The links from the
    /// supporting to the free foot form a chain in the plane.
    fn add_contact(
        &mut self,
        n: usize,
        (kin, eval): (&Kinematics, &Evaluation),
        qdd: &[f64; NV],
        solution: &Solution,
    ) {
        let force = [solution.lam[Y], solution.lam[Z]];
        let chain = Chain::of(kin, eval.point);
        let [y, z] = &mut self.point;
        let (mut by_q, mut by_v) = ([0.0; 2], [0.0; 2]);
        let mut turning: f64 = qdd[2..LEG].iter().sum();
        for c in (2..LEG).rev() {
            let r = chain.link(c);
            let w = kin.w[c - 2].x;
            by_q[0] += w * w * r[1] - turning * r[0];
            by_q[1] -= w * w * r[0] + turning * r[1];
            by_v[0] -= 2.0 * w * r[0];
            by_v[1] -= 2.0 * w * r[1];
            turning -= qdd[c];
            (y[position(c)], z[position(c)]) = (by_q[0], by_q[1]);
            (y[velocity(n, c)], z[velocity(n, c)]) = (by_v[0], by_v[1]);
            let change = chain.torque_change(c, force);
            for j in 2..c {
                self.rows[j][position(c)] -= change;
                self.rows[c][position(j)] -= change;
            }
            self.rows[c][position(c)] -= change;
        }
    }
}

/// Add the derivatives of all torques of the controller. `rnea` has the axes and velocities of the joints.
fn add_feedback(
    model: &Model,
    (kin, rnea): (&Kinematics, &RneaDerivatives),
    (q, v): (&[f64; NV], &[f64; NV]),
    now: &ControllerInput,
    rows: &mut Rows,
) {
    let n = model.n;
    // Where the law began with the leg swap, one column has the derivatives by both times.
    let law = start_of(now.controller.phase);
    let [since_law, since_swap] = times(n);
    let swap = (law != 0).then_some((since_swap, 0));
    for (column, time) in [(since_law, law)].into_iter().chain(swap) {
        let mut input = OpenLoop::<Dual<f64>>::at(now);
        input.times[time].d = -1.0;
        let (torques, _) = input.torques(Broadcast(model), now.mirrored);
        for (row, torque) in rows.iter_mut().zip(torques) {
            row[column] += torque.d;
        }
    }
    let mut add = |row: usize, c: usize, [by_q, by_v]: [f64; 2]| {
        rows[row][position(c)] += by_q;
        rows[row][velocity(n, c)] += by_v;
    };
    head_force::derivatives(model, (kin, rnea), q[1], now, &mut add);
    let now = std::slice::from_ref(now);
    let input = JointInput { q, v, now };
    for term in model.controller_terms.iter().enumerate() {
        each_torque(&input, model, term, kin, |torque| {
            let row = input.coordinate(torque.c);
            let slopes = [-torque.stiffness, -torque.damping];
            if torque.c == HIP {
                let sign = if now[0].mirrored { -1.0 } else { 1.0 };
                PITCH.for_each(|c| add(row, c, slopes.map(|slope| sign * slope)));
            } else {
                add(row, row, slopes);
            }
        });
    }
}

/// The links from the pivot to the free foot's contact point: joints by coordinate, from q1, and the point [m].
#[derive(Debug, Clone, Copy, Default)]
pub struct Chain {
    at: [[f64; 2]; LEG + 1],
}

impl Chain {
    pub fn of(kin: &Kinematics, point: PlanarPoint) -> Self {
        let mut at = [[0.0; 2]; LEG + 1];
        at[ROOT..LEG].copy_from_slice(&kin.joint[1..=FREE_FOOT]);
        at[LEG] = [point.y, point.z];
        Self { at }
    }

    /// From the joint of `c` to the next one.
    pub fn link(&self, c: usize) -> [f64; 2] {
        [0, 1].map(|i| self.at[c + 1][i] - self.at[c][i])
    }

    /// Motion of the point per rotation about the joint of `c`.
    pub fn motion(&self, c: usize) -> [f64; 2] {
        let [point, joint] = [self.at[LEG], self.at[c]];
        [joint[1] - point[1], point[0] - joint[0]]
    }

    /// Decrease of the torque of a force on the point. Two joints turn the lever arm about the outer of them, `c`.
    pub fn torque_change(&self, c: usize, force: [f64; 2]) -> f64 {
        let [y, z] = self.motion(c);
        z * force[0] - y * force[1]
    }
}
