//! The 17 links of Table 1 as rigid bodies.

use crate::{
    model::rigid_body::{Axis, RigidBody},
    scene::body,
};
use nalgebra::{Matrix3, Vector3};

/// A link of Table 1, whose joint may be locked. `parent` is the index of a link.
pub(super) struct Link {
    pub joint: &'static str,
    pub body: RigidBody,
    /// Ends of the line that represents it in drawings, in its frame [m].
    pub ends: [Vector3<f64>; 2],
}

impl Link {
    /// The same with another axis of its joint.
    fn about(mut self, axis: Axis) -> Self {
        self.body.axis = axis;
        self
    }
}

/// A uniform rod of the given kind from its joint along `along`.
fn rod(link: &body::Link, along: Vector3<f64>) -> (f64, Vector3<f64>, Matrix3<f64>) {
    let (m, r, l) = (link.mass, link.radius, link.length);
    let axial = 0.5 * m * r * r;
    let across = m * (3.0 * r * r + l * l) / 12.0;
    let e = along.normalize();
    let inertia = Matrix3::identity() * across + e * e.transpose() * (axial - across);
    (m, 0.5 * l * e, inertia)
}

/// The link that carries the arms and the head, in the list of links.
pub(super) const UPPER_BODY: usize = 9;

/// The 17 links of Table 1, from the supporting foot upwards and outwards (paper, Fig. 1).
pub(super) fn links(body: &body::Body) -> Vec<Link> {
    let up = Vector3::z();
    let down = -up;
    let zero = Vector3::zeros();
    let side = Vector3::x();
    let make = |name, joint, parent, offset, link: &body::Link, along: Vector3<f64>| {
        let (mass, com, inertia) = rod(link, along);
        let body = RigidBody {
            name,
            parent,
            axis: Axis::X,
            offset,
            mass,
            com,
            inertia,
            damping: link.damping,
        };
        let ends = [zero, along * link.length];
        Link { joint, body, ends }
    };
    let foot = |name, joint, parent, offset| {
        let f = &body.foot;
        let (w, l, h) = (f.width, f.toe + f.heel, f.height);
        let box_inertia = Vector3::new(l * l + h * h, w * w + h * h, w * w + l * l);
        let body = RigidBody {
            name,
            parent,
            axis: Axis::X,
            offset,
            mass: f.mass,
            com: Vector3::new(0.0, 0.5 * (f.toe - f.heel), -0.5 * h),
            inertia: Matrix3::from_diagonal(&(box_inertia * f.mass / 12.0)),
            damping: f.damping,
        };
        let ends = [Vector3::new(0.0, -f.heel, -h), Vector3::new(0.0, f.toe, -h)];
        Link { joint, body, ends }
    };
    let b = body;
    // The friction of a joint does not depend on the supporting leg: the ankle has that of the foot, the knee that of
    // the lower leg, the hip that of the upper leg.
    let with = |link: &body::Link, damping: f64| body::Link {
        damping,
        ..link.clone()
    };
    let shin = with(&b.lower_leg, b.foot.damping);
    let thigh = with(&b.upper_leg, b.lower_leg.damping);
    let waist = body::Link {
        length: b.waist.length,
        mass: b.waist.mass,
        damping: b.upper_leg.damping,
        radius: b.waist.radius,
    };
    let (knee, hip) = (up * b.lower_leg.length, up * b.upper_leg.length);
    let (pitch, roll) = (up * b.lower_body.length, up * b.middle_body.length);
    let mut links = vec![
        foot("foot", "q1", 0, zero),
        make("lower_leg", "q2", 0, zero, &shin, up),
        make("upper_leg", "q3", 1, knee, &thigh, up),
        make("waist", "q4", 2, hip, &waist, side),
        make("free_upper_leg", "q5", 3, zero, &b.upper_leg, down),
        make("free_lower_leg", "q6", 4, -hip, &b.lower_leg, down),
        foot("free_foot", "q7", 5, -knee),
        make("lower_body", "q8", 3, zero, &b.lower_body, up).about(Axis::Z),
        make("middle_body", "q9", 7, pitch, &b.middle_body, up),
        make("upper_body", "q10", 8, roll, &b.upper_body, up).about(Axis::Y),
    ];
    links[3].body.com = zero;
    links[3].ends = [side * -0.5 * b.waist.length, side * 0.5 * b.waist.length];
    let right = ["right_upper_arm", "right_lower_arm", "right_hand"];
    let left = ["left_upper_arm", "left_lower_arm", "left_hand"];
    for (arm, joints, sign) in [
        (right, ["q11", "q12", "q13"], 1.0),
        (left, ["q14", "q15", "q16"], -1.0),
    ] {
        let first = links.len();
        let shoulder = Vector3::new(sign * b.shoulder, 0.0, b.upper_body.length);
        let elbow = down * b.upper_arm.length;
        let wrist = down * b.lower_arm.length;
        links.push(make(arm[0], joints[0], 9, shoulder, &b.upper_arm, down));
        links.push(make(arm[1], joints[1], first, elbow, &b.lower_arm, down));
        links.push(make(arm[2], joints[2], first + 1, wrist, &b.hand, down));
    }
    let neck = up * b.upper_body.length;
    links.push(make("head", "q17", 9, neck, &b.head, up));
    links
}

/// Merge a link with the body that carries it: masses add, inertias by the parallel-axis theorem.
pub(super) fn merge(body: &mut RigidBody, link: &RigidBody, offset: Vector3<f64>) {
    let mass = body.mass + link.mass;
    let com_link = offset + link.com;
    let com = (body.mass * body.com + link.mass * com_link) / mass;
    let shift =
        |m: f64, r: Vector3<f64>| m * (Matrix3::identity() * r.norm_squared() - r * r.transpose());
    body.inertia += shift(body.mass, body.com - com);
    body.inertia += link.inertia + shift(link.mass, com_link - com);
    body.mass = mass;
    body.com = com;
}
