//! Spatial algebra with all six components, in the frames of the trunk's bodies.

use crate::numeric::{
    planar::{Planar, PlanarInertia},
    scalar::Scalar,
};
use nalgebra::{Matrix3, Vector3};

/// Moments (rotations) about x, y, z, then forces (translations), at the origin of a body frame.
pub type Spatial<T = f64> = [T; 6];

/// Force and moment at the origin of a body frame.
#[derive(Debug, Clone, Copy, Default)]
pub struct SpatialForce<T = f64>(pub Spatial<T>);

impl<T: Scalar> SpatialForce<T> {
    /// Add a force in the y-z plane that acts at the lateral offset `x` from the origin.
    #[inline(always)]
    pub fn add_at(&mut self, x: T, force: &Planar<T>) {
        self.0[0] += force.n;
        self.0[1] -= x * force.z;
        self.0[2] += x * force.y;
        self.0[4] += force.y;
        self.0[5] += force.z;
    }
}

/// Motion of the body that carries the limbs.
#[derive(Debug, Clone, Copy)]
pub struct SpatialMotion<T = f64>(pub Spatial<T>);

impl<T: Scalar> SpatialMotion<T> {
    /// Component in the y-z plane at the lateral offset `x` from the origin.
    #[inline(always)]
    pub fn planar_at(&self, x: T) -> Planar<T> {
        let m = &self.0;
        Planar {
            y: m[4] + x * m[2],
            z: m[5] - x * m[1],
            n: m[0],
        }
    }
}

/// Out-of-plane inertia of a limb's rods. Across its plane the limb is rigidly attached to its carrier:
/// translation along x and rotations about y and z are those of the carrier.
#[derive(Debug, Clone, Copy)]
pub struct LateralInertia<T = f64> {
    mass: T,
    /// First moments: mass times the centre's coordinates.
    hy: T,
    hz: T,
    about_y: T,
    about_z: T,
    mixed: T,
}

impl<T: Scalar> Default for LateralInertia<T> {
    #[inline(always)]
    fn default() -> Self {
        let zero = T::zero();
        Self {
            mass: zero,
            hy: zero,
            hz: zero,
            about_y: zero,
            about_z: zero,
            mixed: zero,
        }
    }
}

impl<T: Scalar> LateralInertia<T> {
    /// Add a rod of mass `m` with centre `c`, axis (0, -s, co) and moments of inertia `across` and `along`
    /// about the centre.
    #[inline(always)]
    pub fn add(&mut self, m: T, [across, along]: [T; 2], [y, z]: [T; 2], (s, co): (T, T)) {
        let d = along - across;
        let (hy, hz) = (m * y, m * z);
        self.about_y += across + d * s * s + hz * z;
        self.about_z += across + d * co * co + hy * y;
        self.mixed += d * s * co + hy * z;
        self.hz += hz;
        self.hy += hy;
        self.mass += m;
    }
}

/// Symmetric 6 x 6 matrix in blocks: `n` moments per rotation, `h` moments per translation, `f` forces per
/// translation. Of the symmetric blocks only the upper triangle is stored and read.
#[derive(Debug, Clone, Copy)]
pub struct SpatialInertia<T = f64> {
    pub n: [[T; 3]; 3],
    pub h: [[T; 3]; 3],
    pub f: [[T; 3]; 3],
}

impl<T: Scalar> Default for SpatialInertia<T> {
    #[inline(always)]
    fn default() -> Self {
        let none = [[T::zero(); 3]; 3];
        Self {
            n: none,
            h: none,
            f: none,
        }
    }
}

impl SpatialInertia {
    /// Rigid body of mass `m` [kg] with centre of mass `com` [m] and `inertia` about it [kg m2], at the
    /// origin of its frame.
    pub fn rigid(m: f64, com: &Vector3<f64>, inertia: &Matrix3<f64>) -> Self {
        let cross = com.cross_matrix();
        let rows = |M: Matrix3<f64>| std::array::from_fn(|i| std::array::from_fn(|j| M[(i, j)]));
        Self {
            n: rows(inertia - cross * cross * m),
            h: rows(cross * m),
            f: rows(Matrix3::identity() * m),
        }
    }
}

impl<T: Scalar> SpatialInertia<T> {
    /// Add a limb at the lateral offset `x`: its out-of-plane inertia and its articulated inertia in its
    /// plane. Each entry is a single addition, so the sum does not depend on the order of two limbs.
    #[inline(always)]
    pub fn add_limb(&mut self, a: &PlanarInertia<T>, lateral: &LateralInertia<T>, x: T) {
        let Self { n, h, f } = self;
        n[0][0] += a.nn;
        n[0][1] -= x * a.zn;
        n[0][2] += x * a.yn;
        n[1][1] += x * x * a.zz + lateral.about_y;
        n[1][2] -= x * x * a.yz + lateral.mixed;
        n[2][2] += x * x * a.yy + lateral.about_z;
        h[0][1] += a.yn;
        h[0][2] += a.zn;
        h[1][0] += lateral.hz;
        h[1][1] -= x * a.yz;
        h[1][2] -= x * a.zz;
        h[2][0] -= lateral.hy;
        h[2][1] += x * a.yy;
        h[2][2] += x * a.yz;
        f[0][0] += lateral.mass;
        f[1][1] += a.yy;
        f[1][2] += a.yz;
        f[2][2] += a.zz;
    }

    #[inline(always)]
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

/// Entry (i, j) of a symmetric block.
#[inline(always)]
pub fn at<T: Copy>(block: &[[T; 3]; 3], i: usize, j: usize) -> T {
    block[i.min(j)][i.max(j)]
}
