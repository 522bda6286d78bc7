//! Hinges about x: motion, force and articulated inertia in the y-z plane.

use std::ops::AddAssign;

/// Motion or force of a body in its carrier's y-z plane, at the carrier's origin (legs: at O).
#[derive(Debug, Clone, Copy, Default)]
pub struct Planar {
    pub y: f64,
    pub z: f64,
    /// Rotation, or moment, about x.
    pub n: f64,
}

impl AddAssign for Planar {
    #[inline]
    fn add_assign(&mut self, other: Self) {
        self.y += other.y;
        self.z += other.z;
        self.n += other.n;
    }
}

impl Planar {
    /// Work of a force along a unit rotation about the point `p`.
    #[inline]
    fn about(&self, p: [f64; 2]) -> f64 {
        self.n + p[1] * self.y - p[0] * self.z
    }

    /// A unit rotation about the point `p` times `rate`, added.
    #[inline]
    fn turn(&mut self, p: [f64; 2], rate: f64) {
        self.y += p[1] * rate;
        self.z -= p[0] * rate;
        self.n += rate;
    }
}

/// Symmetric: force per acceleration of an articulated body in the plane.
#[derive(Debug, Clone, Copy, Default)]
pub struct PlanarInertia {
    pub yy: f64,
    pub yz: f64,
    pub zz: f64,
    pub yn: f64,
    pub zn: f64,
    pub nn: f64,
}

impl AddAssign for PlanarInertia {
    #[inline]
    fn add_assign(&mut self, other: Self) {
        self.yy += other.yy;
        self.yz += other.yz;
        self.zz += other.zz;
        self.yn += other.yn;
        self.zn += other.zn;
        self.nn += other.nn;
    }
}

impl PlanarInertia {
    /// A rigid body of mass `m`, centre `c` and inertia `J` about it.
    #[inline]
    pub fn rigid(m: f64, c: [f64; 2], J: f64) -> Self {
        let (hy, hz) = (m * c[0], m * c[1]);
        Self {
            yy: m,
            yz: 0.0,
            zz: m,
            yn: -hz,
            zn: hy,
            nn: J + hy * c[0] + hz * c[1],
        }
    }

    /// The same inertia at the origin, given at the point `p`.
    pub fn seen_from_origin(&self, p: [f64; 2]) -> Self {
        let (y, z) = (
            self.yz * p[0] - self.yy * p[1],
            self.zz * p[0] - self.yz * p[1],
        );
        Self {
            yn: self.yn + y,
            zn: self.zn + z,
            nn: self.nn + 2.0 * (self.zn * p[0] - self.yn * p[1]) + (z * p[0] - y * p[1]),
            ..*self
        }
    }

    /// Let a hinge at `p` give way that has an inertia of its own besides: what remains on its other side.
    #[inline]
    pub fn eliminate(&self, p: [f64; 2], own: f64) -> (Hinge, Self) {
        let u = Planar {
            y: self.yy * p[1] - self.yz * p[0] + self.yn,
            z: self.yz * p[1] - self.zz * p[0] + self.zn,
            n: self.yn * p[1] - self.zn * p[0] + self.nn,
        };
        let inverse = 1.0 / (u.about(p) + own);
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
pub struct Hinge {
    /// Where it is: y and z in the carrier's frame (legs: in the world's axes from O).
    p: [f64; 2],
    /// U / D: what a unit of its torque hands on to the parent.
    k: Planar,
    /// 1 / D
    pub inverse: f64,
}

impl Hinge {
    /// Torque `x` less the force on the body: what accelerates the hinge. Returns what the parent feels.
    #[inline]
    pub fn reduce(&self, x: &mut f64, force: Planar) -> Planar {
        let u = *x - force.about(self.p);
        *x = u;
        Planar {
            y: force.y + self.k.y * u,
            z: force.z + self.k.z * u,
            n: force.n + self.k.n * u,
        }
    }

    /// The hinge's acceleration from its reduced torque and its parent's motion, and the body's.
    #[inline]
    pub fn expand(&self, x: &mut f64, up: Planar) -> Planar {
        let k = &self.k;
        *x = *x * self.inverse - (k.y * up.y + k.z * up.z + k.n * up.n);
        let mut motion = up;
        motion.turn(self.p, *x);
        motion
    }
}
