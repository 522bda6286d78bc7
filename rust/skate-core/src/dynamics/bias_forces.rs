//! Inertial and gravity forces on the bodies for q'' = 0: the outward pass of the recursive Newton-Euler
//! algorithm (Featherstone 2008, section 5.3). `ArticulatedBodies::reduce` is the inward pass. Also the
//! energy.
//!
//! Legs in world axes about O, trunk bodies in their own frames, limbs in the frame of their carrier.

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

/// Motion of a frame in its own components: acceleration of the origin minus gravity, angular velocity and
/// angular acceleration.
#[derive(Debug, Clone, Copy)]
struct FrameMotion<T> {
    a: Vector3<T>,
    w: Vector3<T>,
    dw: Vector3<T>,
    /// Acceleration gradient: the columns of the matrix dw x + w x w x, per x, y and z of the position.
    grad: [[T; 3]; 3],
}

impl<T: Scalar> FrameMotion<T> {
    #[inline(always)]
    fn new(a: Vector3<T>, w: Vector3<T>, dw: Vector3<T>) -> Self {
        let (xy, yz, zx) = (w.x * w.y, w.y * w.z, w.z * w.x);
        let (xx, yy, zz) = (w.x * w.x, w.y * w.y, w.z * w.z);
        let grad = [
            [-yy - zz, xy + dw.z, zx - dw.y],
            [xy - dw.z, -zz - xx, yz + dw.x],
            [zx + dw.y, yz - dw.x, -xx - yy],
        ];
        Self { a, w, dw, grad }
    }
}

/// Bias forces of all bodies; see the module documentation. Needs `Kinematics::planar_velocities`.
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
    let mut frame = base_motion(models, kin, g);
    for b in n_planar..=carrier.min(n_planar + TRUNK - 1) {
        let rate = v[coordinate(b)];
        let above = models.number(|m| m.numbers[b].above);
        frame = child_motion((model.axis[b], above), kin.sin_cos[b], rate, &frame);
        forces.trunk[b - n_planar] = trunk_force(models, b, &frame);
    }
    limb_forces(models, kin, v, &frame, forces);
}

/// Motion of the planar body that carries the trunk.
#[inline(always)]
fn base_motion<T: Scalar>(models: impl ModelLanes<T>, kin: &Kinematics<T>, g: T) -> FrameMotion<T> {
    let model = models.shape();
    let b = model.parent[model.n_planar];
    let [y, z] = kin.acceleration(b, kin.joint[b]);
    let ((s, c), z, zero) = (kin.sin_cos[b], z + g, T::zero());
    FrameMotion::new(
        Vector3::new(zero, c * y + s * z, c * z - s * y),
        Vector3::new(kin.w[b].x, zero, zero),
        Vector3::new(zero, zero, zero),
    )
}

/// Motion of the next trunk body, from its parent's.
#[inline(always)]
fn child_motion<T: Scalar>(
    (axis, above): (Axis, T),
    (s, c): (T, T),
    rate: T,
    up: &FrameMotion<T>,
) -> FrameMotion<T> {
    let [x, y, z] = up.grad[2];
    let a = vec3::add(&up.a, &vec3::scale(&Vector3::new(x, y, z), above));
    let (mut w, mut dw) = (
        to_child_frame(axis, (s, c), &up.w),
        to_child_frame(axis, (s, c), &up.dw),
    );
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
    FrameMotion::new(to_child_frame(axis, (s, c), &a), w, dw)
}

/// Components of a vector in a frame that is rotated about `axis`.
#[inline(always)]
fn to_child_frame<T: Scalar>(axis: Axis, (s, c): (T, T), v: &Vector3<T>) -> Vector3<T> {
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
    frame: &FrameMotion<T>,
) -> SpatialForce<T> {
    let body = models.body(b);
    let c = Vector3::new(body.com[0], body.com[1], body.com[2]);
    let mut J = vec3::zeros();
    for i in 0..3 {
        for j in 0..3 {
            J[(i, j)] = models.number(|m| m.bodies[b].inertia[(i, j)]);
        }
    }
    let FrameMotion { a, w, dw, grad } = frame;
    let mut f = *a;
    for (grad, c) in grad.iter().zip(&body.com) {
        for i in 0..3 {
            f[i] += grad[i] * *c;
        }
    }
    let f = vec3::scale(&f, body.mass);
    let turning = vec3::cross(w, &vec3::apply(&J, w));
    let n = vec3::add(&vec3::apply(&J, dw), &turning);
    let n = vec3::add(&n, &vec3::cross(&c, &f));
    SpatialForce([n.x, n.y, n.z, f.x, f.y, f.z])
}

/// Motion of a joint relative to the limb's carrier: angular velocity, velocity and acceleration.
#[derive(Debug, Clone, Copy)]
struct RelativeMotion<T> {
    w: T,
    v: [T; 2],
    a: [T; 2],
}

impl<T: Scalar> RelativeMotion<T> {
    /// A joint fixed to the carrier.
    #[inline(always)]
    fn zero() -> Self {
        let zero = [T::zero(); 2];
        Self {
            w: T::zero(),
            v: zero,
            a: zero,
        }
    }

    /// Motion of a point fixed to the body at `r` from the joint.
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
    carrier: &FrameMotion<T>,
    forces: &mut Forces<T>,
) {
    let model = models.shape();
    let last = model.bodies.len().min(NB);
    let Some(first) = model.carrier.map(|b| b + 1) else {
        return;
    };
    let FrameMotion { a, w, dw, grad } = carrier;
    let two = T::of(2.0);
    let twice = [two * w.x, two * w.y, two * w.z];
    // Components of the limb forces that act on the carrier directly, because no limb joint moves along
    // them.
    let none = vec3::zero();
    let (mut carrier_force, mut limb) = (none, none);
    let (mut joint, mut from) = (RelativeMotion::zero(), [T::zero(); 2]);
    for b in first..last {
        let body = models.body(b);
        let (x, [y, z], p) = (body.side, kin.c[b], kin.joint[b]);
        joint = if model.parent[b] < first {
            RelativeMotion::zero()
        } else {
            joint.at([p[0] - from[0], p[1] - from[1]])
        };
        from = p;
        joint.w += v[coordinate(b)];
        let centre = joint.at([y - p[0], z - p[1]]);
        let [vy, vz] = centre.v;
        let m = body.mass;
        let f = [
            m * (a.x + grad[0][0] * x + grad[1][0] * y + grad[2][0] * z + twice[1] * vz
                - twice[2] * vy),
            m * (a.y + grad[0][1] * x + grad[1][1] * y + grad[2][1] * z - twice[0] * vz
                + centre.a[0]),
            m * (a.z
                + grad[0][2] * x
                + grad[1][2] * y
                + grad[2][2] * z
                + twice[0] * vy
                + centre.a[1]),
        ];
        // Euler's equation for a rod along e = (0, -s, c): J = a 1 + d e e^T.
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
            carrier_force = vec3::add(&carrier_force, &limb);
            limb = none;
        }
    }
    let carrier = &mut forces.trunk[(model.n_trunk - 1).min(TRUNK - 1)].0;
    carrier[3] += carrier_force.x;
    carrier[1] += carrier_force.y;
    carrier[2] += carrier_force.z;
}

/// Kinetic energy and potential energy [J]; the ice is the zero of height, O is at the height `z0` [m].
/// Needs `Kinematics::frames` and `planar_velocities`.
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
    // Velocity of the frame's origin and angular velocity, in its own components.
    let up = model.parent[model.n_planar];
    let joint = Vector3::new(0.0, kin.joint[up][0], kin.joint[up][1]);
    let mut u = to_child_frame(Axis::X, kin.sin_cos[up], &kin.point_velocity(up, &joint));
    let mut w = kin.w[up];
    for b in model.n_planar..=carrier {
        let (body, axis, turn) = (&model.numbers[b], model.axis[b], kin.sin_cos[b]);
        u += w.cross(&Vector3::new(0.0, 0.0, body.above));
        (u, w) = (
            to_child_frame(axis, turn, &u),
            to_child_frame(axis, turn, &w),
        );
        w[axis as usize] += v[coordinate(b)];
        let com = Vector3::from(body.com);
        let moves = u + w.cross(&com);
        twice += body.mass * moves.norm_squared() + w.dot(&(model.bodies[b].inertia * w));
        moment += body.mass * (z0 + kin.p[b].z + (kin.R[b] * com).z);
    }
    let (mut joint, mut from) = (RelativeMotion::zero(), [0.0; 2]);
    for b in carrier + 1..model.bodies.len() {
        let (body, [y, z], p) = (&model.numbers[b], kin.c[b], kin.joint[b]);
        joint = match model.parent[b] == carrier {
            true => RelativeMotion::zero(),
            false => joint.at([p[0] - from[0], p[1] - from[1]]),
        };
        from = p;
        joint.w += v[coordinate(b)];
        let [vy, vz] = joint.at([y - p[0], z - p[1]]).v;
        let centre = Vector3::new(body.side, y, z);
        let moves = u + w.cross(&centre) + Vector3::new(0.0, vy, vz);
        let turns = w + Vector3::new(joint.w, 0.0, 0.0);
        // Rod along (0, -s, c).
        let (s, c) = kin.sin_cos[b];
        let along = c * turns.z - s * turns.y;
        twice += body.mass * moves.norm_squared() + body.across * turns.norm_squared();
        twice += (body.along - body.across) * along * along;
        moment += body.mass * (z0 + kin.p[carrier].z + (kin.R[carrier] * centre).z);
    }
    (0.5 * twice, model.scene.ice.gravity * moment)
}
