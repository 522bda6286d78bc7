//! Hinges about x: motion, force and articulated inertia in the y-z plane.

use crate::numeric::scalar::Scalar;
use std::ops::AddAssign;

/// Motion or force of a body in its carrier's y-z plane, at the carrier's origin (legs: at O).
#[derive(Debug, Clone, Copy)]
pub struct Planar<T = f64> {
    pub y: T,
    pub z: T,
    /// Rotation, or moment, about x.
    pub n: T,
}

impl<T: Scalar> Default for Planar<T> {
    #[inline(always)]
    fn default() -> Self {
        let zero = T::zero();
        Self {
            y: zero,
            z: zero,
            n: zero,
        }
    }
}

impl<T: Scalar> AddAssign for Planar<T> {
    #[inline(always)]
    fn add_assign(&mut self, other: Self) {
        self.y += other.y;
        self.z += other.z;
        self.n += other.n;
    }
}

impl<T: Scalar> Planar<T> {
    /// Work of a force along a unit rotation about the point `p`.
    #[inline(always)]
    fn moment_about(&self, p: [T; 2]) -> T {
        self.n + p[1] * self.y - p[0] * self.z
    }

    /// A unit rotation about the point `p` times `rate`, added.
    #[inline(always)]
    fn add_rotation(&mut self, p: [T; 2], rate: T) {
        self.y += p[1] * rate;
        self.z -= p[0] * rate;
        self.n += rate;
    }
}

/// Symmetric: force per acceleration of an articulated body in the plane.
#[derive(Debug, Clone, Copy)]
pub struct PlanarInertia<T = f64> {
    pub yy: T,
    pub yz: T,
    pub zz: T,
    pub yn: T,
    pub zn: T,
    pub nn: T,
}

impl<T: Scalar> Default for PlanarInertia<T> {
    #[inline(always)]
    fn default() -> Self {
        let zero = T::zero();
        Self {
            yy: zero,
            yz: zero,
            zz: zero,
            yn: zero,
            zn: zero,
            nn: zero,
        }
    }
}

impl<T: Scalar> AddAssign for PlanarInertia<T> {
    #[inline(always)]
    fn add_assign(&mut self, other: Self) {
        self.yy += other.yy;
        self.yz += other.yz;
        self.zz += other.zz;
        self.yn += other.yn;
        self.zn += other.zn;
        self.nn += other.nn;
    }
}

impl<T: Scalar> PlanarInertia<T> {
    /// A rigid body of mass `m`, centre `c` and inertia `J` about it.
    #[inline(always)]
    pub fn rigid(m: T, c: [T; 2], J: T) -> Self {
        let (hy, hz) = (m * c[0], m * c[1]);
        Self {
            yy: m,
            yz: T::zero(),
            zz: m,
            yn: -hz,
            zn: hy,
            nn: J + hy * c[0] + hz * c[1],
        }
    }

    /// The same inertia at the origin, given at the point `p`.
    #[inline(always)]
    pub fn moved_to_origin(&self, p: [T; 2]) -> Self {
        let (y, z) = (
            self.yz * p[0] - self.yy * p[1],
            self.zz * p[0] - self.yz * p[1],
        );
        Self {
            yn: self.yn + y,
            zn: self.zn + z,
            nn: self.nn + T::of(2.0) * (self.zn * p[0] - self.yn * p[1]) + (z * p[0] - y * p[1]),
            ..*self
        }
    }

    /// Let a hinge at `p` give way that has an inertia of its own besides: what remains on its other side.
    #[inline(always)]
    pub fn eliminate(&self, p: [T; 2], own: T) -> (Hinge<T>, Self) {
        let u = Planar {
            y: self.yy * p[1] - self.yz * p[0] + self.yn,
            z: self.yz * p[1] - self.zz * p[0] + self.zn,
            n: self.yn * p[1] - self.zn * p[0] + self.nn,
        };
        let inverse = T::one() / (u.moment_about(p) + own);
        let k = Planar {
            y: u.y * inverse,
            z: u.z * inverse,
            n: u.n * inverse,
        };
        let left = Self {
            yy: self.yy - k.y * u.y,
            yz: self.yz - k.y * u.z,
            zz: self.zz - k.z * u.z,
            yn: self.yn - k.y * u.n,
            zn: self.zn - k.z * u.n,
            nn: self.nn - k.n * u.n,
        };
        (Hinge { p, k, inverse }, left)
    }
}

/// An eliminated hinge about x.
#[derive(Debug, Clone, Copy, Default)]
pub struct Hinge<T: Scalar = f64> {
    /// Where it is: y and z in the carrier's frame (legs: in the world's axes from O).
    p: [T; 2],
    /// U / D: what a unit of its torque hands on to the parent.
    k: Planar<T>,
    /// 1 / D
    pub inverse: T,
}

impl<T: Scalar> Hinge<T> {
    /// Torque `x` less the force on the body: what accelerates the hinge. Returns what the parent feels.
    #[inline(always)]
    pub fn reduce(&self, x: &mut T, force: Planar<T>) -> Planar<T> {
        let u = *x - force.moment_about(self.p);
        *x = u;
        Planar {
            y: force.y + self.k.y * u,
            z: force.z + self.k.z * u,
            n: force.n + self.k.n * u,
        }
    }

    /// The hinge's acceleration from its reduced torque and its parent's motion, and the body's.
    #[inline(always)]
    pub fn expand(&self, x: &mut T, up: Planar<T>) -> Planar<T> {
        let k = &self.k;
        *x = *x * self.inverse - (k.y * up.y + k.z * up.z + k.n * up.n);
        let mut motion = up;
        motion.add_rotation(self.p, *x);
        motion
    }
}
