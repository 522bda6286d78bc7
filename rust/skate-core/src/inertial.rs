//! Inertial and gravity forces on the single bodies for q'' = 0: the outward half of Newton and Euler
//! (Featherstone 2008, section 5.3). `Articulated::reduce` is the inward half.
//!
//! The legs in the world's axes about O, the trunk's bodies in their own frames, the limbs in the
//! frame of the body that carries them.

use crate::{
    articulated::Forces,
    kinematics::Kinematics,
    model::{Axis, Model, NB, NV, RigidBody, coordinate},
    planar::Planar,
    spatial::SpatialForce,
};
use nalgebra::Vector3;

/// How a frame moves, in its own components: acceleration of its origin less gravity, angular velocity
/// and acceleration.
#[derive(Debug, Clone, Copy)]
struct Moving {
    a: Vector3<f64>,
    w: Vector3<f64>,
    dw: Vector3<f64>,
    /// Acceleration of a point relative to the origin per x, y and z of its place: the columns of
    /// dw x + w x w x.
    by: [[f64; 3]; 3],
}

impl Moving {
    #[inline]
    fn new(a: Vector3<f64>, w: Vector3<f64>, dw: Vector3<f64>) -> Self {
        let (xy, yz, zx) = (w.x * w.y, w.y * w.z, w.z * w.x);
        let (xx, yy, zz) = (w.x * w.x, w.y * w.y, w.z * w.z);
        let by = [
            [-yy - zz, xy + dw.z, zx - dw.y],
            [xy - dw.z, -zz - xx, yz + dw.x],
            [zx + dw.y, yz - dw.x, -xx - yy],
        ];
        Self { a, w, dw, by }
    }
}

/// See the module's documentation; needs `Kinematics::planar_velocities`.
pub fn forces(model: &Model, kin: &Kinematics, v: &[f64; NV], forces: &mut Forces) {
    let bodies = &model.bodies[..model.bodies.len().min(NB)];
    let g = model.scene.ice.gravity;
    let n_planar = model.n_planar.min(bodies.len());
    for (b, body) in bodies[..n_planar].iter().enumerate() {
        let c = kin.c[b];
        let [y, z] = kin.acceleration(b, c);
        let f = [body.mass * y, body.mass * (z + g)];
        forces.planar[b] = Planar {
            y: f[0],
            z: f[1],
            n: c[0] * f[1] - c[1] * f[0],
        };
    }
    let Some(carrier) = model.carrier else {
        return;
    };
    let mut moving = base(model, kin, g);
    for b in n_planar..=carrier {
        let (body, rate) = (&bodies[b], v[coordinate(b)]);
        moving = carried(body, kin.sin_cos[b], rate, &moving);
        forces.trunk[b - n_planar] = trunk_force(body, &moving);
    }
    limb_forces(model, kin, v, &moving, forces);
}

/// The planar body that carries the trunk.
fn base(model: &Model, kin: &Kinematics, g: f64) -> Moving {
    let b = model.bodies[model.n_planar].parent;
    let [y, z] = kin.acceleration(b, kin.joint[b]);
    let ((s, c), z) = (kin.sin_cos[b], z + g);
    Moving::new(
        Vector3::new(0.0, c * y + s * z, c * z - s * y),
        Vector3::new(kin.w[b].x, 0.0, 0.0),
        Vector3::zeros(),
    )
}

/// The next body of the trunk, from its parent.
#[inline]
fn carried(body: &RigidBody, (s, c): (f64, f64), rate: f64, up: &Moving) -> Moving {
    let a = up.a + Vector3::from(up.by[2]) * body.offset.z;
    let (w, dw) = (&up.w, &up.dw);
    let turn = |v: &Vector3<f64>| match body.axis {
        Axis::X => Vector3::new(v.x, c * v.y + s * v.z, c * v.z - s * v.y),
        Axis::Y => Vector3::new(c * v.x - s * v.z, v.y, c * v.z + s * v.x),
        Axis::Z => Vector3::new(c * v.x + s * v.y, c * v.y - s * v.x, v.z),
    };
    let (mut w, mut dw) = (turn(w), turn(dw));
    match body.axis {
        Axis::X => {
            (dw.y, dw.z) = (dw.y + w.z * rate, dw.z - w.y * rate);
            w.x += rate;
        }
        Axis::Y => {
            (dw.z, dw.x) = (dw.z + w.x * rate, dw.x - w.z * rate);
            w.y += rate;
        }
        Axis::Z => {
            (dw.x, dw.y) = (dw.x + w.y * rate, dw.y - w.x * rate);
            w.z += rate;
        }
    }
    Moving::new(turn(&a), w, dw)
}

#[inline]
fn trunk_force(body: &RigidBody, moving: &Moving) -> SpatialForce {
    let (c, J) = (&body.com, &body.inertia);
    let Moving { a, w, dw, by } = moving;
    let [x, y, z] = by.map(Vector3::from);
    let f = (a + x * c.x + y * c.y + z * c.z) * body.mass;
    let n = J * dw + w.cross(&(J * w)) + c.cross(&f);
    SpatialForce([n.x, n.y, n.z, f.x, f.y, f.z])
}

/// Joint of a limb's body relative to the carrier: angular velocity, velocity and acceleration.
#[derive(Debug, Clone, Copy, Default)]
struct Relative {
    w: f64,
    v: [f64; 2],
    a: [f64; 2],
}

impl Relative {
    /// The same for a point at `r` from the joint, fixed to the body.
    #[inline]
    fn at(&self, r: [f64; 2]) -> Self {
        let w = self.w;
        Self {
            w,
            v: [self.v[0] - w * r[1], self.v[1] + w * r[0]],
            a: [self.a[0] - w * w * r[0], self.a[1] - w * w * r[1]],
        }
    }
}

fn limb_forces(
    model: &Model,
    kin: &Kinematics,
    v: &[f64; NV],
    carrier: &Moving,
    forces: &mut Forces,
) {
    let last = model.bodies.len().min(NB);
    let Some(first) = model.carrier.map(|b| b + 1) else {
        return;
    };
    let Moving { a, w, dw, by } = carrier;
    let twice = [2.0 * w.x, 2.0 * w.y, 2.0 * w.z];
    // Forces on the carrier that no joint of a limb takes up.
    let (mut across, mut limb) = (Vector3::zeros(), Vector3::zeros());
    let (mut joint, mut from) = (Relative::default(), [0.0; 2]);
    for b in first..last {
        let body = &model.bodies[b];
        let (x, [y, z], p) = (model.side[b], kin.c[b], kin.joint[b]);
        joint = if body.parent < first {
            Relative::default()
        } else {
            joint.at([p[0] - from[0], p[1] - from[1]])
        };
        from = p;
        joint.w += v[coordinate(b)];
        let centre = joint.at([y - p[0], z - p[1]]);
        let [vy, vz] = centre.v;
        let m = body.mass;
        let f = [
            m * (a.x + by[0][0] * x + by[1][0] * y + by[2][0] * z + twice[1] * vz - twice[2] * vy),
            m * (a.y + by[0][1] * x + by[1][1] * y + by[2][1] * z - twice[0] * vz + centre.a[0]),
            m * (a.z + by[0][2] * x + by[1][2] * y + by[2][2] * z + twice[0] * vy + centre.a[1]),
        ];
        // Euler's equation of a rod along e = (0, -s, c): J = a 1 + d e e^T.
        let (s, c) = kin.sin_cos[b];
        let (a, d) = (body.inertia.m11, body.inertia.m33 - body.inertia.m11);
        let wx = w.x + joint.w;
        let (dy, dz) = (dw.y + w.z * joint.w, dw.z - w.y * joint.w);
        let (along, turning) = (d * (c * w.z - s * w.y), d * (c * dz - s * dy));
        let n = [
            a * dw.x + along * (c * w.y + s * w.z),
            a * dy - s * turning - c * along * wx,
            a * dz + c * turning - s * along * wx,
        ];
        forces.planar[b] = Planar {
            y: f[1],
            z: f[2],
            n: n[0] + y * f[2] - z * f[1],
        };
        limb += Vector3::new(f[0], n[1] + z * f[0], n[2] - y * f[0]);
        if b + 1 == last || model.bodies[b + 1].parent < first {
            across += limb;
            limb = Vector3::zeros();
        }
    }
    let carrier = &mut forces.trunk[first - 1 - model.n_planar].0;
    carrier[3] += across.x;
    carrier[1] += across.y;
    carrier[2] += across.z;
}
