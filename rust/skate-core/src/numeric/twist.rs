//! Motions and forces of rigid bodies in one common frame (Featherstone 2008, chapter 2).

use nalgebra::Vector3;

/// Angular velocity and velocity of the body-fixed point at the origin, or accelerations.
#[derive(Debug, Clone, Copy, Default)]
pub struct Twist {
    pub w: Vector3<f64>,
    pub v: Vector3<f64>,
}

/// Moment about the origin and force.
#[derive(Debug, Clone, Copy, Default)]
pub struct Wrench {
    pub n: Vector3<f64>,
    pub f: Vector3<f64>,
}

impl Twist {
    /// self x m
    #[inline(always)]
    pub fn cross(&self, m: &Self) -> Self {
        Self {
            w: self.w.cross(&m.w),
            v: self.w.cross(&m.v) + self.v.cross(&m.w),
        }
    }

    /// self x* f
    #[inline(always)]
    pub fn cross_force(&self, f: &Wrench) -> Wrench {
        Wrench {
            n: self.w.cross(&f.n) + self.v.cross(&f.f),
            f: self.w.cross(&f.f),
        }
    }

    /// Power of a force.
    #[inline(always)]
    pub fn dot(&self, f: &Wrench) -> f64 {
        self.w.dot(&f.n) + self.v.dot(&f.f)
    }

    /// self + m x
    #[inline(always)]
    pub fn add_scaled(&self, m: &Self, x: f64) -> Self {
        Self {
            w: self.w + m.w * x,
            v: self.v + m.v * x,
        }
    }

    #[inline(always)]
    pub fn minus(&self, m: &Self) -> Self {
        self.add_scaled(m, -1.0)
    }

    /// Velocity of the body-fixed point at `p`.
    #[inline(always)]
    pub fn at(&self, p: &Vector3<f64>) -> Vector3<f64> {
        self.v + self.w.cross(p)
    }
}

impl Wrench {
    /// The force `f` at the point `p`.
    #[inline(always)]
    pub fn at(p: &Vector3<f64>, f: Vector3<f64>) -> Self {
        Self { n: p.cross(&f), f }
    }

    /// self + f x
    #[inline(always)]
    pub fn add_scaled(&self, f: &Self, x: f64) -> Self {
        Self {
            n: self.n + f.n * x,
            f: self.f + f.f * x,
        }
    }
}
