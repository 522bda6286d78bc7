//! The trunk's joints q8, q9, q10 in the frames of their bodies, where an axis is a component and
//! eliminating it is reading a column (Featherstone 2008, section 7.3 and appendix A).

use crate::{
    articulated::{Planar, PlanarInertia},
    kinematics::Kinematics,
    model::{Axis, Model, NV, RigidBody, coordinate},
};
use nalgebra::Vector3;

/// Most joints of the trunk.
pub const TRUNK: usize = 3;

/// Moments (rotations) about x, y, z, then forces (translations), at the origin of a body's frame.
type Spatial = [f64; 6];

/// A force and its moment at the origin of a body's frame.
#[derive(Debug, Clone, Copy, Default)]
pub struct SpatialForce(pub Spatial);

impl SpatialForce {
    pub fn of(n: &Vector3<f64>, f: &Vector3<f64>) -> Self {
        Self([n.x, n.y, n.z, f.x, f.y, f.z])
    }

    /// Add a force in the y-z plane at the distance `x` beside the origin.
    #[inline]
    pub fn add_at(&mut self, x: f64, force: &Planar) {
        self.0[0] += force.n;
        self.0[1] -= x * force.z;
        self.0[2] += x * force.y;
        self.0[4] += force.y;
        self.0[5] += force.z;
    }
}

/// Motion of the body that carries the limbs.
#[derive(Debug, Clone, Copy)]
pub struct SpatialMotion(Spatial);

impl SpatialMotion {
    /// Its part in the y-z plane at the distance `x` beside the origin.
    #[inline]
    pub fn planar_at(&self, x: f64) -> Planar {
        let m = &self.0;
        Planar {
            y: m[4] + x * m[2],
            z: m[5] - x * m[1],
            n: m[0],
        }
    }
}

/// Symmetric 6 x 6 matrix, all entries kept: whole rows are cheaper than triangles.
pub type SpatialInertia = [Spatial; 6];

/// Of a rigid body, at the origin of its frame.
pub fn rigid(body: &RigidBody) -> SpatialInertia {
    let (m, c) = (body.mass, body.com);
    let cross = c.cross_matrix();
    let about = body.inertia - cross * cross * m;
    std::array::from_fn(|i| {
        std::array::from_fn(|j| match (i < 3, j < 3) {
            (true, true) => about[(i, j)],
            (true, false) => m * cross[(i, j - 3)],
            (false, true) => m * cross[(j, i - 3)],
            (false, false) => f64::from(u8::from(i == j)) * m,
        })
    })
}

/// What the limbs add to the inertia of their carrier.
#[derive(Debug, Clone, Copy, Default)]
pub struct Carried {
    inertia: SpatialInertia,
}

impl Carried {
    /// Across the plane a limb is as stiff as if it were rigid: its bodies' motion along x and their
    /// rotations about y and z are the carrier's.
    #[inline]
    pub fn add_rod(&mut self, body: &RigidBody, c: [f64; 2], (s, co): (f64, f64)) {
        let (m, [y, z]) = (body.mass, c);
        let (across, axial) = (body.inertia.m11, body.inertia.m33);
        // The rod's axis is (0, -s, co).
        let d = axial - across;
        let (hy, hz) = (m * y, m * z);
        let I = &mut self.inertia;
        I[1][1] += across + d * s * s + hz * z;
        I[2][2] += across + d * co * co + hy * y;
        I[1][2] -= d * s * co + hy * z;
        I[3][3] += m;
        I[1][3] += hz;
        I[2][3] -= hy;
    }

    /// Its articulated inertia in the plane at the distance `x` beside the origin.
    #[inline]
    pub fn add_limb(&mut self, a: &PlanarInertia, x: f64) {
        let I = &mut self.inertia;
        I[0][0] += a.nn;
        I[0][1] -= x * a.zn;
        I[0][2] += x * a.yn;
        I[0][4] += a.yn;
        I[0][5] += a.zn;
        I[1][1] += x * x * a.zz;
        I[1][2] -= x * x * a.yz;
        I[1][4] -= x * a.yz;
        I[1][5] -= x * a.zz;
        I[2][2] += x * x * a.yy;
        I[2][4] += x * a.yy;
        I[2][5] += x * a.yz;
        I[4][4] += a.yy;
        I[4][5] += a.yz;
        I[5][5] += a.zz;
    }

    /// Add the carrier's own inertia; the limbs' was summed above the diagonal only.
    fn on(mut self, own: &SpatialInertia) -> SpatialInertia {
        let I = &mut self.inertia;
        for i in 0..6 {
            for j in 0..i {
                I[i][j] = I[j][i];
            }
        }
        add(I, own);
        self.inertia
    }
}

#[inline]
fn add(I: &mut SpatialInertia, other: &SpatialInertia) {
    for (row, more) in I.iter_mut().zip(other) {
        for (x, y) in row.iter_mut().zip(more) {
            *x += y;
        }
    }
}

/// A joint's body is turned by an angle about the axis `A`, `l` above its parent's origin. These take
/// components from the body's frame to its parent's (`out`) and from its parent's to its own (`back`).
#[derive(Debug, Clone, Copy)]
struct Frame {
    s: f64,
    c: f64,
    l: f64,
}

/// The two axes that a joint about `A` turns, first towards second.
const fn turned(axis: usize) -> (usize, usize) {
    ((axis + 1) % 3, (axis + 2) % 3)
}

impl Frame {
    #[inline]
    fn of(model: &Model, kin: &Kinematics, b: usize) -> Self {
        let (s, c) = kin.sin_cos[b];
        let l = model.bodies[b].offset.z;
        Self { s, c, l }
    }

    #[inline]
    fn out<const A: usize>(self, v: &mut [f64]) {
        let (j, k) = turned(A);
        (v[j], v[k]) = (self.c * v[j] - self.s * v[k], self.s * v[j] + self.c * v[k]);
    }

    #[inline]
    fn back<const A: usize>(self, v: &mut [f64]) {
        let (j, k) = turned(A);
        (v[j], v[k]) = (self.c * v[j] + self.s * v[k], self.c * v[k] - self.s * v[j]);
    }

    #[inline]
    fn force_out<const A: usize>(self, f: &mut Spatial) {
        self.out::<A>(&mut f[..3]);
        self.out::<A>(&mut f[3..]);
        f[0] -= self.l * f[4];
        f[1] += self.l * f[3];
    }

    #[inline]
    fn motion_back<const A: usize>(self, m: &mut Spatial) {
        m[3] += self.l * m[1];
        m[4] -= self.l * m[0];
        self.back::<A>(&mut m[..3]);
        self.back::<A>(&mut m[3..]);
    }

    /// X I X^T, X being `force_out`.
    #[inline]
    fn inertia_out<const A: usize>(self, I: &mut SpatialInertia) {
        let (j, k) = turned(A);
        for (j, k) in [(j, k), (j + 3, k + 3)] {
            let (row_j, row_k) = (I[j], I[k]);
            for i in 0..6 {
                I[j][i] = self.c * row_j[i] - self.s * row_k[i];
                I[k][i] = self.s * row_j[i] + self.c * row_k[i];
            }
        }
        for i in 0..6 {
            I[0][i] -= self.l * I[4][i];
            I[1][i] += self.l * I[3][i];
        }
        for row in I {
            self.force_out::<A>(row);
        }
    }
}

/// An eliminated joint: U / D and 1 / D.
#[derive(Debug, Clone, Copy, Default)]
struct Joint {
    k: Spatial,
    inverse: f64,
}

/// Let a joint give way: what its parent feels of the inertia on its other side.
fn eliminate<const A: usize>(joint: &mut Joint, frame: Frame, I: &mut SpatialInertia) {
    let u = I[A];
    joint.inverse = 1.0 / u[A];
    joint.k = u.map(|x| x * joint.inverse);
    for i in 0..6 {
        for j in 0..6 {
            I[i][j] -= joint.k[i] * u[j];
        }
    }
    frame.inertia_out::<A>(I);
}

/// Torque `x` less the force on the body: what accelerates the joint; the rest goes to the parent.
fn reduce<const A: usize>(joint: &Joint, frame: Frame, x: &mut f64, force: &mut Spatial) {
    *x -= force[A];
    for i in 0..6 {
        force[i] += joint.k[i] * *x;
    }
    frame.force_out::<A>(force);
}

/// The joint's acceleration from its reduced torque and the parent's motion; then the body's motion.
fn expand<const A: usize>(joint: &Joint, frame: Frame, x: &mut f64, motion: &mut Spatial) {
    frame.motion_back::<A>(motion);
    let held: f64 = joint.k.iter().zip(&*motion).map(|(k, m)| k * m).sum();
    *x = *x * joint.inverse - held;
    motion[A] += *x;
}

/// Call a function with the axis of a joint as a constant.
macro_rules! for_axis {
    ($axis:expr, $function:ident($($argument:expr),*)) => {
        match $axis {
            Axis::X => $function::<0>($($argument),*),
            Axis::Y => $function::<1>($($argument),*),
            Axis::Z => $function::<2>($($argument),*),
        }
    };
}

/// The trunk's joints, eliminated.
#[derive(Debug, Clone, Default)]
pub struct Trunk {
    joints: [Joint; TRUNK],
}

impl Trunk {
    /// Eliminate the trunk's joints; what its planar base feels, in the world's axes at O.
    pub fn factor(&mut self, model: &Model, kin: &Kinematics, carried: Carried) -> PlanarInertia {
        let n = model.trunk.len().min(TRUNK);
        let mut I = carried.on(&model.trunk[n - 1]);
        for i in (0..n).rev() {
            let b = model.n_planar + i;
            let frame = Frame::of(model, kin, b);
            let joint = &mut self.joints[i];
            for_axis!(model.bodies[b].axis, eliminate(joint, frame, &mut I));
            if i > 0 {
                add(&mut I, &model.trunk[i - 1]);
            }
        }
        let (s, c) = kin.sin_cos[model.bodies[model.n_planar].parent];
        let (yy, yz, zz) = (I[4][4], I[4][5], I[5][5]);
        let mix = 2.0 * s * c * yz;
        let turned = PlanarInertia {
            yy: c * c * yy - mix + s * s * zz,
            yz: s * c * (yy - zz) + (c * c - s * s) * yz,
            zz: s * s * yy + mix + c * c * zz,
            yn: c * I[0][4] - s * I[0][5],
            zn: s * I[0][4] + c * I[0][5],
            nn: I[0][0],
        };
        turned.seen_from_origin(base(model, kin))
    }

    /// See `Articulated::reduce`; what remains for the planar base, in the world's axes at O.
    pub fn reduce(
        &self,
        model: &Model,
        kin: &Kinematics,
        forces: &[SpatialForce; TRUNK],
        x: &mut [f64; NV],
    ) -> Planar {
        let mut f = [0.0; 6];
        for i in (0..model.trunk.len().min(TRUNK)).rev() {
            let b = model.n_planar + i;
            for (sum, own) in f.iter_mut().zip(&forces[i].0) {
                *sum += own;
            }
            let frame = Frame::of(model, kin, b);
            let x = &mut x[coordinate(b)];
            for_axis!(
                model.bodies[b].axis,
                reduce(&self.joints[i], frame, x, &mut f)
            );
        }
        let [y, z] = kin.turned(model.bodies[model.n_planar].parent, f[4], f[5]);
        let p = base(model, kin);
        let n = f[0] + p[0] * z - p[1] * y;
        Planar { y, z, n }
    }

    /// See `Articulated::expand`; `up` is the base's motion, the result the carrier's.
    pub fn expand(
        &self,
        model: &Model,
        kin: &Kinematics,
        up: Planar,
        x: &mut [f64; NV],
    ) -> SpatialMotion {
        let p = base(model, kin);
        let (y, z) = (up.y - up.n * p[1], up.z + up.n * p[0]);
        let (s, c) = kin.sin_cos[model.bodies[model.n_planar].parent];
        let mut motion = [up.n, 0.0, 0.0, 0.0, c * y + s * z, c * z - s * y];
        for i in 0..model.trunk.len().min(TRUNK) {
            let b = model.n_planar + i;
            let frame = Frame::of(model, kin, b);
            let x = &mut x[coordinate(b)];
            for_axis!(
                model.bodies[b].axis,
                expand(&self.joints[i], frame, x, &mut motion)
            );
        }
        SpatialMotion(motion)
    }
}

/// Origin of the body that carries the trunk, from O in the world's axes.
fn base(model: &Model, kin: &Kinematics) -> [f64; 2] {
    kin.joint[model.bodies[model.n_planar].parent]
}
