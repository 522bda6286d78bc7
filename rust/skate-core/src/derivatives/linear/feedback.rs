//! Derivatives of the controller's torques.

use crate::{
    control::{
        ControllerInput, OpenLoop,
        feedforward::start_of,
        head_force,
        joint::{HIP, JointInput, PITCH},
        joint_torques::each_torque,
    },
    derivatives::linear::inputs::{Rows, position, times, velocity},
    dynamics::{kinematics::Kinematics, rnea_derivatives::RneaDerivatives},
    model::{Model, lanes::Broadcast, layout::NV},
    numeric::dual::Dual,
};

/// Add the derivatives of all torques. `rnea` has the axes and velocities of the joints.
pub fn add(
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
