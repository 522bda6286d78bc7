//! Elementary functions that IEEE 754 does not round exactly.
//!
//! The standard library calls the system's mathematical library, whose last bit depends on the system and,
//! with glibc, on whether the processor has fused multiply-add. With the feature `portable-math` the crate
//! `libm` computes them, with the same bits on every target.

/// Sine and cosine of an angle [rad].
#[inline(always)]
pub fn sin_cos(x: f64) -> (f64, f64) {
    #[cfg(feature = "portable-math")]
    {
        libm::sincos(x)
    }
    #[cfg(not(feature = "portable-math"))]
    {
        x.sin_cos()
    }
}

/// Sine of an angle [rad].
#[inline(always)]
pub fn sin(x: f64) -> f64 {
    #[cfg(feature = "portable-math")]
    {
        libm::sin(x)
    }
    #[cfg(not(feature = "portable-math"))]
    {
        x.sin()
    }
}

/// `x` to the power of `y`.
#[inline(always)]
pub fn pow(x: f64, y: f64) -> f64 {
    #[cfg(feature = "portable-math")]
    {
        libm::pow(x, y)
    }
    #[cfg(not(feature = "portable-math"))]
    {
        x.powf(y)
    }
}
