//! The paper's 17 links as line segments in the world, for drawings.

use crate::{
    model::{
        Model,
        layout::{FREE_FOOT, FREE_LOWER_LEG, NB, UPPER_LEG, WAIST},
    },
    rhs::Evaluation,
    scene::Leg,
};
use nalgebra::Vector3;

/// Ends of every link in the world [m]; `eval` holds the poses, (y0, z0) the pivot.
pub fn segments(
    model: &Model,
    eval: &Evaluation,
    (y0, z0): (f64, f64),
    leg: Leg,
) -> [[[f64; 3]; 2]; NB] {
    let support_side = leg.sign() * model.half_hip;
    std::array::from_fn(|link| {
        let segment = &model.segments[link];
        // The dynamics are planar; drawings show the legs at half the hip width beside the plane.
        let side = match link {
            0..=UPPER_LEG => support_side,
            4..=FREE_FOOT => -support_side,
            _ => 0.0,
        };
        segment.ends.map(|end| {
            let p = eval.kin.point(model, segment.body, &end);
            [p.x + side, p.y + y0, p.z + z0]
        })
    })
}

/// Lateral offset of a body's joint, which the planar dynamics omit [m].
pub fn side_offset(model: &Model, body: usize, leg: Leg) -> f64 {
    let side = leg.sign() * model.half_hip;
    match body {
        0 => side,
        b if b == FREE_LOWER_LEG - 1 => -2.0 * side,
        b if b > FREE_FOOT && model.bodies[b].parent == WAIST => -side,
        _ => 0.0,
    }
}

/// Centre of mass of a body in drawings: that of the waist lies between the legs.
pub fn com(model: &Model, body: usize, leg: Leg) -> Vector3<f64> {
    let side = if body == WAIST {
        -leg.sign() * model.half_hip
    } else {
        0.0
    };
    model.bodies[body].com + Vector3::new(side, 0.0, 0.0)
}
