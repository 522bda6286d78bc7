//! Inertial and gravity forces on the single bodies for q'' = 0: the outward half of Newton and Euler
//! (Featherstone 2008, section 5.3), of which `ArticulatedBodies::reduce` is the inward half; and their energy.
//!
//! The legs in the world's axes about O, the trunk's bodies in their own frames, the limbs in the
//! frame of the body that carries them.

use crate::{
    dynamics::{aba::Forces, kinematics::Kinematics},
    model::{
        Model,
        lanes::ModelLanes,
        layout::{NB, NV, TRUNK, coordinate},
        rigid_body::Axis,
    },
    numeric::{planar::Planar, scalar::Scalar, spatial::SpatialForce, vec3},
};
use nalgebra::Vector3;

/// How a frame moves, in its own components: acceleration of its origin less gravity, angular velocity
/// and acceleration.
#[derive(Debug, Clone, Copy)]
struct Moving<T> {
    a: Vector3<T>,
    w: Vector3<T>,
    dw: Vector3<T>,
    /// Acceleration of a point relative to the origin per x, y and z of its place: the columns of
    /// dw x + w x w x.
    by: [[T; 3]; 3],
}

impl<T: Scalar> Moving<T> {
    #[inline(always)]
    fn new(a: Vector3<T>, w: Vector3<T>, dw: Vector3<T>) -> Self {
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
#[inline(always)]
pub fn forces<T: Scalar>(
    models: impl ModelLanes<T>,
    kin: &Kinematics<T>,
    v: &[T; NV],
    forces: &mut Forces<T>,
) {
    let model = models.shape();
    let g = models.number(|m| m.scene.ice.gravity);
    let n_planar = model.n_planar.min(NB);
    for b in 0..n_planar {
        let (mass, c) = (models.number(|m| m.numbers[b].mass), kin.c[b]);
        let [y, z] = kin.acceleration(b, c);
        let f = [mass * y, mass * (z + g)];
        forces.planar[b] = Planar {
            y: f[0],
            z: f[1],
            n: c[0] * f[1] - c[1] * f[0],
        };
    }
    let Some(carrier) = model.carrier else {
        return;
    };
    let mut moving = base(models, kin, g);
    for b in n_planar..=carrier.min(n_planar + TRUNK - 1) {
        let rate = v[coordinate(b)];
        let above = models.number(|m| m.numbers[b].above);
        moving = carried((model.axis[b], above), kin.sin_cos[b], rate, &moving);
        forces.trunk[b - n_planar] = trunk_force(models, b, &moving);
    }
    limb_forces(models, kin, v, &moving, forces);
}

/// The planar body that carries the trunk.
#[inline(always)]
fn base<T: Scalar>(models: impl ModelLanes<T>, kin: &Kinematics<T>, g: T) -> Moving<T> {
    let model = models.shape();
    let b = model.parent[model.n_planar];
    let [y, z] = kin.acceleration(b, kin.joint[b]);
    let ((s, c), z, zero) = (kin.sin_cos[b], z + g, T::zero());
    Moving::new(
        Vector3::new(zero, c * y + s * z, c * z - s * y),
        Vector3::new(kin.w[b].x, zero, zero),
        Vector3::new(zero, zero, zero),
    )
}

/// The next body of the trunk, from its parent.
#[inline(always)]
fn carried<T: Scalar>(
    (axis, above): (Axis, T),
    (s, c): (T, T),
    rate: T,
    up: &Moving<T>,
) -> Moving<T> {
    let [x, y, z] = up.by[2];
    let a = vec3::add(&up.a, &vec3::scale(&Vector3::new(x, y, z), above));
    let (mut w, mut dw) = (turned(axis, (s, c), &up.w), turned(axis, (s, c), &up.dw));
    match axis {
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
    Moving::new(turned(axis, (s, c), &a), w, dw)
}

/// A vector in the frame of a body that is turned by an angle about an axis.
#[inline(always)]
fn turned<T: Scalar>(axis: Axis, (s, c): (T, T), v: &Vector3<T>) -> Vector3<T> {
    match axis {
        Axis::X => Vector3::new(v.x, c * v.y + s * v.z, c * v.z - s * v.y),
        Axis::Y => Vector3::new(c * v.x - s * v.z, v.y, c * v.z + s * v.x),
        Axis::Z => Vector3::new(c * v.x + s * v.y, c * v.y - s * v.x, v.z),
    }
}

#[inline(always)]
fn trunk_force<T: Scalar>(
    models: impl ModelLanes<T>,
    b: usize,
    moving: &Moving<T>,
) -> SpatialForce<T> {
    let body = models.body(b);
    let c = Vector3::new(body.com[0], body.com[1], body.com[2]);
    let mut J = vec3::zeros();
    for i in 0..3 {
        for j in 0..3 {
            J[(i, j)] = models.number(|m| m.bodies[b].inertia[(i, j)]);
        }
    }
    let Moving { a, w, dw, by } = moving;
    let mut f = *a;
    for (by, c) in by.iter().zip(&body.com) {
        for i in 0..3 {
            f[i] += by[i] * *c;
        }
    }
    let f = vec3::scale(&f, body.mass);
    let turning = vec3::cross(w, &vec3::apply(&J, w));
    let n = vec3::add(&vec3::apply(&J, dw), &turning);
    let n = vec3::add(&n, &vec3::cross(&c, &f));
    SpatialForce([n.x, n.y, n.z, f.x, f.y, f.z])
}

/// Joint of a limb's body relative to the carrier: angular velocity, velocity and acceleration.
#[derive(Debug, Clone, Copy)]
struct Relative<T> {
    w: T,
    v: [T; 2],
    a: [T; 2],
}

impl<T: Scalar> Relative<T> {
    /// That of a joint fixed to the carrier.
    #[inline(always)]
    fn rest() -> Self {
        let zero = [T::zero(); 2];
        Self {
            w: T::zero(),
            v: zero,
            a: zero,
        }
    }

    /// The same for a point at `r` from the joint, fixed to the body.
    #[inline(always)]
    fn at(&self, r: [T; 2]) -> Self {
        let w = self.w;
        Self {
            w,
            v: [self.v[0] - w * r[1], self.v[1] + w * r[0]],
            a: [self.a[0] - w * w * r[0], self.a[1] - w * w * r[1]],
        }
    }
}

#[inline(always)]
fn limb_forces<T: Scalar>(
    models: impl ModelLanes<T>,
    kin: &Kinematics<T>,
    v: &[T; NV],
    carrier: &Moving<T>,
    forces: &mut Forces<T>,
) {
    let model = models.shape();
    let last = model.bodies.len().min(NB);
    let Some(first) = model.carrier.map(|b| b + 1) else {
        return;
    };
    let Moving { a, w, dw, by } = carrier;
    let two = T::of(2.0);
    let twice = [two * w.x, two * w.y, two * w.z];
    // Forces on the carrier that no joint of a limb takes up.
    let none = vec3::zero();
    let (mut across, mut limb) = (none, none);
    let (mut joint, mut from) = (Relative::rest(), [T::zero(); 2]);
    for b in first..last {
        let body = models.body(b);
        let (x, [y, z], p) = (body.side, kin.c[b], kin.joint[b]);
        joint = if model.parent[b] < first {
            Relative::rest()
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
        let (a, d) = (body.across, body.along - body.across);
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
        limb = vec3::add(&limb, &Vector3::new(f[0], n[1] + z * f[0], n[2] - y * f[0]));
        if b + 1 == last || model.parent[b + 1] < first {
            across = vec3::add(&across, &limb);
            limb = none;
        }
    }
    let carrier = &mut forces.trunk[(model.n_trunk - 1).min(TRUNK - 1)].0;
    carrier[3] += across.x;
    carrier[1] += across.y;
    carrier[2] += across.z;
}

/// Kinetic energy, and potential energy above the ice with O at the height `z0` [J]; needs
/// `Kinematics::frames` and `planar_velocities`.
pub fn energy(model: &Model, kin: &Kinematics, v: &[f64; NV], z0: f64) -> (f64, f64) {
    let (mut twice, mut moment) = (0.0, 0.0);
    for (b, body) in model.numbers[..model.n_planar].iter().enumerate() {
        let ([y, z], w, v) = (kin.c[b], kin.w[b].x, &kin.v[b]);
        let (vy, vz) = (v.y - w * z, v.z + w * y);
        twice += body.mass * (vy * vy + vz * vz) + body.across * w * w;
        moment += body.mass * (z0 + z);
    }
    let Some(carrier) = model.carrier else {
        return (0.5 * twice, model.scene.ice.gravity * moment);
    };
    // Velocity of a frame's origin and its angular velocity, in its own components.
    let up = model.parent[model.n_planar];
    let joint = Vector3::new(0.0, kin.joint[up][0], kin.joint[up][1]);
    let mut u = turned(Axis::X, kin.sin_cos[up], &kin.point_velocity(up, &joint));
    let mut w = kin.w[up];
    for b in model.n_planar..=carrier {
        let (body, axis, turn) = (&model.numbers[b], model.axis[b], kin.sin_cos[b]);
        u += w.cross(&Vector3::new(0.0, 0.0, body.above));
        (u, w) = (turned(axis, turn, &u), turned(axis, turn, &w));
        w[axis as usize] += v[coordinate(b)];
        let com = Vector3::from(body.com);
        let moves = u + w.cross(&com);
        twice += body.mass * moves.norm_squared() + w.dot(&(model.bodies[b].inertia * w));
        moment += body.mass * (z0 + kin.p[b].z + (kin.R[b] * com).z);
    }
    let (mut joint, mut from) = (Relative::rest(), [0.0; 2]);
    for b in carrier + 1..model.bodies.len() {
        let (body, [y, z], p) = (&model.numbers[b], kin.c[b], kin.joint[b]);
        joint = match model.parent[b] == carrier {
            true => Relative::rest(),
            false => joint.at([p[0] - from[0], p[1] - from[1]]),
        };
        from = p;
        joint.w += v[coordinate(b)];
        let [vy, vz] = joint.at([y - p[0], z - p[1]]).v;
        let centre = Vector3::new(body.side, y, z);
        let moves = u + w.cross(&centre) + Vector3::new(0.0, vy, vz);
        let turns = w + Vector3::new(joint.w, 0.0, 0.0);
        // A rod along (0, -s, c).
        let (s, c) = kin.sin_cos[b];
        let along = c * turns.z - s * turns.y;
        twice += body.mass * moves.norm_squared() + body.across * turns.norm_squared();
        twice += (body.along - body.across) * along * along;
        moment += body.mass * (z0 + kin.p[carrier].z + (kin.R[carrier] * centre).z);
    }
    (0.5 * twice, model.scene.ice.gravity * moment)
}
