//! Symmetric 3 x 3 matrices, six numbers.

use nalgebra::{Matrix3, Vector3};
use std::ops::AddAssign;

/// An inertia about some point.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub struct Symmetric {
    pub xx: f64,
    pub yy: f64,
    pub zz: f64,
    pub yz: f64,
    pub zx: f64,
    pub xy: f64,
}

impl Symmetric {
    /// Moment of a mass at `c`: m (c.c 1 - c c^T).
    #[inline]
    pub fn of_point(m: f64, c: &Vector3<f64>) -> Self {
        let mc = c * m;
        let (x, y, z) = (mc.x * c.x, mc.y * c.y, mc.z * c.z);
        Self {
            xx: y + z,
            yy: z + x,
            zz: x + y,
            yz: -mc.y * c.z,
            zx: -mc.z * c.x,
            xy: -mc.x * c.y,
        }
    }

    /// A rod along the unit vector `e`: across 1 + (axial - across) e e^T.
    #[inline]
    pub fn of_rod(across: f64, axial: f64, e: &Vector3<f64>) -> Self {
        let s = e * (axial - across);
        Self {
            xx: across + s.x * e.x,
            yy: across + s.y * e.y,
            zz: across + s.z * e.z,
            yz: s.y * e.z,
            zx: s.z * e.x,
            xy: s.x * e.y,
        }
    }

    /// R I R^T for a symmetric `I`.
    pub fn of_turned(R: &Matrix3<f64>, I: &Matrix3<f64>) -> Self {
        let J = R * I * R.transpose();
        Self {
            xx: J.m11,
            yy: J.m22,
            zz: J.m33,
            yz: J.m23,
            zx: J.m31,
            xy: J.m12,
        }
    }

    #[inline]
    pub fn times(&self, v: &Vector3<f64>) -> Vector3<f64> {
        Vector3::new(
            self.xx * v.x + self.xy * v.y + self.zx * v.z,
            self.xy * v.x + self.yy * v.y + self.yz * v.z,
            self.zx * v.x + self.yz * v.y + self.zz * v.z,
        )
    }
}

impl AddAssign for Symmetric {
    #[inline]
    fn add_assign(&mut self, other: Self) {
        self.xx += other.xx;
        self.yy += other.yy;
        self.zz += other.zz;
        self.yz += other.yz;
        self.zx += other.zx;
        self.xy += other.xy;
    }
}
