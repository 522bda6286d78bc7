//! Forces, motions and inertias with all six components, in the frames of the trunk's bodies.

use crate::{
    model::RigidBody,
    planar::{Planar, PlanarInertia},
};
use nalgebra::Matrix3;

/// Moments (rotations) about x, y, z, then forces (translations), at the origin of a body's frame.
pub type Spatial = [f64; 6];

/// A force and its moment at the origin of a body's frame.
#[derive(Debug, Clone, Copy, Default)]
pub struct SpatialForce(pub Spatial);

impl SpatialForce {
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
pub struct SpatialMotion(pub Spatial);

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

/// A limb's rods as its carrier feels them across the limb's plane, where it is as stiff as if it were
/// rigid: its bodies' motion along x and their rotations about y and z are the carrier's.
#[derive(Debug, Clone, Copy, Default)]
pub struct Rods {
    mass: f64,
    /// Mass times the centre's place.
    hy: f64,
    hz: f64,
    about_y: f64,
    about_z: f64,
    mixed: f64,
}

impl Rods {
    /// One more, with its centre at `c` and its axis at (0, -s, co).
    #[inline]
    pub fn add(&mut self, body: &RigidBody, c: [f64; 2], (s, co): (f64, f64)) {
        let (m, [y, z]) = (body.mass, c);
        let (across, d) = (body.inertia.m11, body.inertia.m33 - body.inertia.m11);
        let (hy, hz) = (m * y, m * z);
        self.about_y += across + d * s * s + hz * z;
        self.about_z += across + d * co * co + hy * y;
        self.mixed += d * s * co + hy * z;
        self.hz += hz;
        self.hy += hy;
        self.mass += m;
    }
}

/// Symmetric 6 x 6 matrix in blocks: `n` moments per rotation, `h` moments per translation, `f` forces
/// per translation. The symmetric blocks are kept and read above the diagonal only.
#[derive(Debug, Clone, Copy, Default)]
pub struct SpatialInertia {
    pub n: [[f64; 3]; 3],
    pub h: [[f64; 3]; 3],
    pub f: [[f64; 3]; 3],
}

impl SpatialInertia {
    /// Of a rigid body, at the origin of its frame.
    pub fn rigid(body: &RigidBody) -> Self {
        let (m, cross) = (body.mass, body.com.cross_matrix());
        let rows = |M: Matrix3<f64>| std::array::from_fn(|i| std::array::from_fn(|j| M[(i, j)]));
        Self {
            n: rows(body.inertia - cross * cross * m),
            h: rows(cross * m),
            f: rows(Matrix3::identity() * m),
        }
    }

    /// Add a limb: its rods, and its articulated inertia in its plane, at the distance `x` beside the origin.
    /// Each entry is added to once, so that two limbs may change places.
    #[inline]
    pub fn add_limb(&mut self, a: &PlanarInertia, rods: &Rods, x: f64) {
        let Self { n, h, f } = self;
        n[0][0] += a.nn;
        n[0][1] -= x * a.zn;
        n[0][2] += x * a.yn;
        n[1][1] += x * x * a.zz + rods.about_y;
        n[1][2] -= x * x * a.yz + rods.mixed;
        n[2][2] += x * x * a.yy + rods.about_z;
        h[0][1] += a.yn;
        h[0][2] += a.zn;
        h[1][0] += rods.hz;
        h[1][1] -= x * a.yz;
        h[1][2] -= x * a.zz;
        h[2][0] -= rods.hy;
        h[2][1] += x * a.yy;
        h[2][2] += x * a.yz;
        f[0][0] += rods.mass;
        f[1][1] += a.yy;
        f[1][2] += a.yz;
        f[2][2] += a.zz;
    }

    #[inline]
    pub fn add(&mut self, other: &Self) {
        for i in 0..3 {
            for j in 0..3 {
                self.n[i][j] += other.n[i][j];
                self.h[i][j] += other.h[i][j];
                self.f[i][j] += other.f[i][j];
            }
        }
    }
}

/// Entry of a symmetric block.
#[inline]
pub fn at(block: &[[f64; 3]; 3], i: usize, j: usize) -> f64 {
    block[i.min(j)][i.max(j)]
}
