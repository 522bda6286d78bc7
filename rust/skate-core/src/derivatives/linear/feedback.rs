//! Derivatives of the controller's torques.

use crate::{
    control::{ControllerInput, feedforward, lifting},
    derivatives::linear::inputs::{Rows, position, times, velocity},
    dynamics::{kinematics::Kinematics, rnea_derivatives::RneaDerivatives},
    model::{
        Model,
        controller_state::Phase,
        controller_terms::Term,
        layout::{NV, ROOT, WAIST, coordinate},
    },
    numeric::{dual::Dual, elementary, scalar::Scalar, trig::sin_cos_of, twist::Wrench},
};
use nalgebra::Vector3;
use std::f64::consts::PI;

/// Coordinates of the knees and of the supporting hip.
const KNEE: usize = ROOT + 1;
const HIP: usize = ROOT + 2;
const FREE_KNEE: usize = ROOT + 4;

/// Add the derivatives of all torques. `rnea` has the axes and velocities of the joints.
pub fn add(
    model: &Model,
    (kin, rnea): (&Kinematics, &RneaDerivatives),
    (q, v): (&[f64; NV], &[f64; NV]),
    now: &ControllerInput,
    rows: &mut Rows,
) {
    let n = model.n;
    let mut head = HeadForce::default();
    // A leg joint in the controller's numbering: sign and coordinate.
    let joint = |c: usize| match now.mirrored {
        true => (-1.0, 11 - c),
        false => (1.0, c),
    };
    for term in &model.controller_terms {
        match term {
            Term::Feedforward(law) => {
                let phase = now.controller.phase;
                let angle = Dual::<f64> {
                    x: feedforward::phase(now.t, &now.controller),
                    d: PI,
                };
                let (_, cos) = sin_cos_of(angle);
                let tau7 = Dual::of(now.controller.tau7);
                let mut tau = [Dual::default(); NV];
                let scales = feedforward::scales(law).map(Dual::of);
                feedforward::add(scales, phase, (cos, tau7), &mut tau);
                for (row, tau) in rows.iter_mut().zip(tau) {
                    row[times(n)[0]] += tau.d;
                }
            }
            Term::ArmSwing { amplitude, yaw } => {
                let (_, cos) = elementary::sin_cos(PI * (now.t - now.controller.t0));
                let sign = now.controller.leg.sign();
                rows[*yaw][times(n)[1]] += sign * amplitude * PI * cos;
            }
            Term::Lifting(law) => {
                head.stiffness += Vector3::from(law.K_p);
                head.target = [law.ahead, law.height - q[1]];
            }
            Term::HeadDamping(law) => head.damping += Vector3::new(0.0, law.y, law.z),
            Term::HipPd(pd) => {
                for c in 2..=coordinate(WAIST) {
                    rows[HIP][position(c)] -= pd.gain;
                    rows[HIP][velocity(n, c)] -= pd.damping;
                }
            }
            Term::FreeKneePd(pd) => {
                if now.controller.phase == Some(Phase::Swing) {
                    let (sign, c) = joint(FREE_KNEE);
                    rows[FREE_KNEE][position(c)] -= sign * pd.gain;
                    rows[FREE_KNEE][velocity(n, c)] -= sign * pd.damping;
                }
            }
            Term::KneeStop(stop) => {
                for (knee, side) in [(KNEE, -1.0), (FREE_KNEE, 1.0)] {
                    let (sign, c) = joint(knee);
                    let (angle, rate) = (side * sign * q[c], side * sign * v[c]);
                    if angle > 0.0 {
                        let by_q = stop.stiffness * (1.0 + stop.damping * rate);
                        rows[knee][position(c)] -= sign * by_q;
                        rows[knee][velocity(n, c)] -= sign * stop.stiffness * angle * stop.damping;
                    }
                }
            }
        }
    }
    if now.controller.supported {
        head.add(model, (kin, rnea), now, rows);
    }
    if now.mirrored {
        // See `control::renumber_joints`.
        rows[ROOT..ROOT + 6].reverse();
        let couple = rows[2];
        for row in &mut rows[ROOT..ROOT + 6] {
            for (entry, couple) in row.iter_mut().zip(couple) {
                *entry = couple - *entry;
            }
        }
    }
}

/// Forces on the head, see `control::lifting`.
#[derive(Debug, Clone, Default)]
struct HeadForce {
    stiffness: Vector3<f64>,
    damping: Vector3<f64>,
    /// In front of the ankle, and above the pivot [m].
    target: [f64; 2],
}

impl HeadForce {
    fn add(
        &self,
        model: &Model,
        (kin, rnea): (&Kinematics, &RneaDerivatives),
        now: &ControllerInput,
        rows: &mut Rows,
    ) {
        let zero = Vector3::zeros();
        if self.stiffness == zero && self.damping == zero {
            return;
        }
        let n = model.n;
        let leg = lifting::leg(std::slice::from_ref(now));
        let (head, ankle) = (kin.psi(model), kin.p[leg[0]]);
        // Coordinates that move the head and the ankle.
        let (to_head, to_ankle) = (coordinate(model.head.0), coordinate(leg[0]));
        let moves = |c: usize, by: usize| c == by || precedes(model, by, c);
        let twist = |c: usize| &rnea.velocity[c];
        let target = Vector3::new(0.0, ankle.y + self.target[0], self.target[1]);
        let relative = twist(to_head).at(&head) - twist(to_ankle).at(&ankle);
        let force =
            self.stiffness.component_mul(&(target - head)) - self.damping.component_mul(&relative);
        let wrench = Wrench::at(&head, force);
        let chain = model.head_chain.iter().map(|&c| (c, c));
        let legs = (0..3).map(|i| (ROOT + i, coordinate(leg[i])));
        let mut torques = [(0, 0); NV];
        let mut len = 0;
        for pair in legs.chain(chain) {
            torques[len] = pair;
            len += 1;
        }
        let torques = &torques[..len];
        let lowered = Vector3::new(0.0, 0.0, -self.stiffness.z);
        let by_height = Wrench::at(&head, lowered);
        for &(row, c) in torques {
            rows[row][position(1)] += rnea.axis[c].dot(&by_height);
        }
        for j in 2..n {
            let axis = &rnea.axis[j];
            let (mut d_head, mut d_ankle, mut d_relative) = (zero, zero, zero);
            let mut change = |c: usize, p: &Vector3<f64>, sign: f64, dp: &mut Vector3<f64>| {
                if moves(c, j) {
                    *dp = axis.at(p);
                    let turned = axis.cross(&twist(c).minus(twist(j)));
                    d_relative += (turned.at(p) + twist(c).w.cross(dp)) * sign;
                }
            };
            change(to_head, &head, 1.0, &mut d_head);
            change(to_ankle, &ankle, -1.0, &mut d_ankle);
            if d_head == zero && d_ankle == zero {
                continue;
            }
            let moved = Vector3::new(0.0, d_ankle.y, 0.0) - d_head;
            let by_q =
                self.stiffness.component_mul(&moved) - self.damping.component_mul(&d_relative);
            let mut by_q = Wrench::at(&head, by_q);
            by_q.n += d_head.cross(&force);
            let by_v = self.damping.component_mul(&(d_ankle - d_head));
            let by_v = Wrench::at(&head, by_v);
            let turned = axis.cross_force(&wrench);
            for &(row, c) in torques {
                let axis = &rnea.axis[c];
                let mut torque = axis.dot(&by_q);
                if precedes(model, j, c) {
                    torque -= axis.dot(&turned);
                }
                rows[row][position(j)] += torque;
                rows[row][velocity(n, j)] += axis.dot(&by_v);
            }
        }
    }
}

/// Is `a` an ancestor of `c`?
fn precedes(model: &Model, a: usize, c: usize) -> bool {
    model.depth[a] < model.depth[c] && model.ancestors[c][model.depth[a]] == a
}
