//! Elementary functions that IEEE 754 does not round exactly.
//!
//! The standard library calls the system's mathematical library, whose last bit depends on the system and,
//! with glibc, on whether the processor has fused multiply-add. With the feature `portable-math` the crate
//! `libm` computes them, with the same bits on every target.

#[cfg(feature = "portable-math")]
pub use libm::{pow, sin, sincos as sin_cos};

#[cfg(not(feature = "portable-math"))]
pub use system::{pow, sin, sin_cos};

#[cfg(not(feature = "portable-math"))]
mod system {
    /// Sine and cosine of an angle [rad].
    #[inline(always)]
    pub fn sin_cos(x: f64) -> (f64, f64) {
        x.sin_cos()
    }

    /// Sine of an angle [rad].
    #[inline(always)]
    pub fn sin(x: f64) -> f64 {
        x.sin()
    }

    /// `x` to the power of `y`.
    #[inline(always)]
    pub fn pow(x: f64, y: f64) -> f64 {
        x.powf(y)
    }
}
