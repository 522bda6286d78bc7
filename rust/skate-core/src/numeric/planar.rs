//! Planar spatial algebra for hinges about x: motion, force and articulated inertia in the y-z plane.

use crate::numeric::scalar::Scalar;
use std::ops::AddAssign;

/// Implements zero and sums of numbers by component. Derived ones are not inlined into functions for wide registers.
macro_rules! componentwise {
    ($name:ident { $($field:ident),* }) => {
        impl<T: Scalar> Default for $name<T> {
            #[inline(always)]
            fn default() -> Self {
                Self { $($field: T::zero()),* }
            }
        }

        impl<T: Scalar> AddAssign for $name<T> {
            #[inline(always)]
            fn add_assign(&mut self, other: Self) {
                $(self.$field += other.$field;)*
            }
        }
    };
}

/// Motion or force of a body in the y-z plane of its carrier, at the carrier's origin (legs: at O).
#[derive(Debug, Clone, Copy)]
pub struct Planar<T = f64> {
    pub y: T,
    pub z: T,
    /// Rotation or moment about x.
    pub n: T,
}

componentwise!(Planar { y, z, n });

impl<T: Scalar> Planar<T> {
    /// Moment of the force about the point `p`: its power for a unit rotation about `p`.
    #[inline(always)]
    fn moment_about(&self, p: [T; 2]) -> T {
        self.n + p[1] * self.y - p[0] * self.z
    }

    /// Add a rotation about the point `p` at `rate`.
    #[inline(always)]
    fn add_rotation(&mut self, p: [T; 2], rate: T) {
        self.y += p[1] * rate;
        self.z -= p[0] * rate;
        self.n += rate;
    }
}

/// Symmetric planar articulated inertia: force per acceleration.
#[derive(Debug, Clone, Copy)]
pub struct PlanarInertia<T = f64> {
    pub yy: T,
    pub yz: T,
    pub zz: T,
    pub yn: T,
    pub zn: T,
    pub nn: T,
}

componentwise!(PlanarInertia {
    yy,
    yz,
    zz,
    yn,
    zn,
    nn
});

impl<T: Scalar> PlanarInertia<T> {
    /// Rigid body of mass `m` with centre of mass `c` and moment of inertia `J` about it.
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

    /// Translate an inertia that is expressed at the point `p` to the origin.
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

    /// Eliminate a hinge at `p`. `added` is added to D (armature or implicit damping). Returns the hinge and
    /// the articulated inertia that its parent sees.
    #[inline(always)]
    pub fn eliminate(&self, p: [T; 2], added: T) -> (Hinge<T>, Self) {
        let u = Planar {
            y: self.yy * p[1] - self.yz * p[0] + self.yn,
            z: self.yz * p[1] - self.zz * p[0] + self.zn,
            n: self.yn * p[1] - self.zn * p[0] + self.nn,
        };
        let inverse = T::one() / (u.moment_about(p) + added);
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
    /// Position: y and z in the carrier's frame (legs: in world axes from O).
    p: [T; 2],
    /// U / D: force on the parent per unit torque.
    k: Planar<T>,
    /// 1 / D
    pub inverse: T,
}

impl Hinge {
    /// The same in every lane.
    #[inline(always)]
    pub fn broadcast<T: Scalar>(&self) -> Hinge<T> {
        Hinge {
            p: [T::of(self.p[0]), T::of(self.p[1])],
            k: Planar {
                y: T::of(self.k.y),
                z: T::of(self.k.z),
                n: T::of(self.k.n),
            },
            inverse: T::of(self.inverse),
        }
    }
}

impl<T: Scalar> Hinge<T> {
    /// Inward pass: replace the torque `x` by the reduced torque, `x` minus the moment of `force`. Returns
    /// the force on the parent.
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

    /// Outward pass: replace the reduced torque `x` by the hinge's acceleration, given the parent's motion.
    /// Returns the motion of the body.
    #[inline(always)]
    pub fn expand(&self, x: &mut T, up: Planar<T>) -> Planar<T> {
        let k = &self.k;
        *x = *x * self.inverse - (k.y * up.y + k.z * up.z + k.n * up.n);
        let mut motion = up;
        motion.add_rotation(self.p, *x);
        motion
    }
}
