//! Dual numbers: a value and its derivatives along several directions (forward-mode differentiation).
//!
//! The value undergoes the operations of an `f64`, in the same order, so it has the same bits. A comparison
//! compares values; a selection takes the derivative of what it selects.

use crate::numeric::scalar::Scalar;
use std::ops::{Add, AddAssign, Div, DivAssign, Mul, MulAssign, Neg, Sub, SubAssign};

/// A value `x` and its derivatives `d`, one direction per lane of `R`.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub struct Dual<R> {
    pub x: f64,
    pub d: R,
}

impl<R: Scalar> Neg for Dual<R> {
    type Output = Self;
    #[inline(always)]
    fn neg(self) -> Self {
        Self {
            x: -self.x,
            d: -self.d,
        }
    }
}

impl<R: Scalar> Add for Dual<R> {
    type Output = Self;
    #[inline(always)]
    fn add(self, other: Self) -> Self {
        Self {
            x: self.x + other.x,
            d: self.d + other.d,
        }
    }
}

impl<R: Scalar> Sub for Dual<R> {
    type Output = Self;
    #[inline(always)]
    fn sub(self, other: Self) -> Self {
        Self {
            x: self.x - other.x,
            d: self.d - other.d,
        }
    }
}

impl<R: Scalar> Mul for Dual<R> {
    type Output = Self;
    #[inline(always)]
    fn mul(self, other: Self) -> Self {
        Self {
            x: self.x * other.x,
            d: R::of(self.x) * other.d + R::of(other.x) * self.d,
        }
    }
}

impl<R: Scalar> Div for Dual<R> {
    type Output = Self;
    #[inline(always)]
    fn div(self, other: Self) -> Self {
        let x = self.x / other.x;
        Self {
            x,
            d: (self.d - R::of(x) * other.d) * R::of(1.0 / other.x),
        }
    }
}

/// Implements an assigning operator from its binary form.
macro_rules! assign {
    ($trait:ident, $method:ident, $operator:tt) => {
        impl<R: Scalar> $trait for Dual<R> {
            #[inline(always)]
            fn $method(&mut self, other: Self) {
                *self = *self $operator other;
            }
        }
    };
}
assign!(AddAssign, add_assign, +);
assign!(SubAssign, sub_assign, -);
assign!(MulAssign, mul_assign, *);
assign!(DivAssign, div_assign, /);

impl<R: Scalar> Scalar for Dual<R> {
    type Mask = bool;
    /// One number; the directions are not lanes.
    const LANES: usize = 1;
    const HAS_DERIVATIVES: bool = true;

    #[inline(always)]
    fn in_one_function<U>(task: impl FnOnce() -> U) -> U {
        R::in_one_function(task)
    }
    #[inline(always)]
    fn of(x: f64) -> Self {
        Self { x, d: R::zero() }
    }
    #[inline(always)]
    fn from_lanes(of: impl Fn(usize) -> f64) -> Self {
        Self::of(of(0))
    }
    #[inline(always)]
    fn lane(&self, _: usize) -> f64 {
        self.x
    }
    #[inline(always)]
    fn detached(self) -> Self {
        Self::of(self.x)
    }
    #[inline(always)]
    fn abs(self) -> Self {
        if self.x.is_sign_negative() {
            -self
        } else {
            self
        }
    }
    #[inline(always)]
    fn lt(self, other: Self) -> bool {
        self.x < other.x
    }
    #[inline(always)]
    fn le(self, other: Self) -> bool {
        self.x <= other.x
    }
    #[inline(always)]
    fn select(mask: bool, yes: Self, no: Self) -> Self {
        if mask { yes } else { no }
    }
    #[inline(always)]
    fn rotate_by_quadrant(shifted: Self, sin: Self, cos: Self) -> (Self, Self) {
        let (s, c) = f64::rotate_by_quadrant(shifted.x, sin.x, cos.x);
        let quadrant = shifted.x.to_bits();
        let (ds, dc) = if quadrant & 1 == 1 {
            (cos.d, sin.d)
        } else {
            (sin.d, cos.d)
        };
        let signed = |d: R, negative: u64| if negative & 2 == 0 { d } else { -d };
        (
            Self {
                x: s,
                d: signed(ds, quadrant),
            },
            Self {
                x: c,
                d: signed(dc, quadrant.wrapping_add(1)),
            },
        )
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::numeric::trig::sin_cos_of;

    /// Derivatives of sine, cosine and their quotient over many turns; the values have the bits of `f64`.
    #[test]
    fn derivatives_of_elementary_functions() {
        let mut worst: f64 = 0.0;
        for i in -4000..4000 {
            let x = 0.013 * f64::from(i) + 1e-4;
            let (s, c) = sin_cos_of(Dual { x, d: 1.0 });
            assert_eq!((s.x, c.x), sin_cos_of(x));
            worst = worst.max((s.d - c.x).abs()).max((c.d + s.x).abs());
            let quotient = s / c;
            let error = quotient.d * c.x * c.x - 1.0;
            worst = worst.max(error.abs() * c.x.abs());
        }
        assert!(worst < 2e-15, "{worst}");
    }
}
