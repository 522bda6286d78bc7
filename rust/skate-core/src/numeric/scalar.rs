//! Scalar type of the equations of motion: an `f64` or a SIMD register of `f64` lanes.
//!
//! All operations on lanes are the `f64` operations, lane by lane: no fused multiply-add and no reordered
//! sums. A computation without branches therefore gives every lane the same bits as the scalar computation.

use crate::numeric::simd::with_avx2;
use std::{
    fmt::Debug,
    ops::{
        Add, AddAssign, BitAnd, BitOr, Div, DivAssign, Mul, MulAssign, Neg, Not, Sub, SubAssign,
    },
};

/// Maximum number of lanes of a register.
pub const MAX_LANES: usize = 8;

/// Real scalar with one or more lanes; see the module documentation.
pub trait Scalar:
    Copy
    + Debug
    + Default
    + PartialEq
    + 'static
    + Neg<Output = Self>
    + Add<Output = Self>
    + Sub<Output = Self>
    + Mul<Output = Self>
    + Div<Output = Self>
    + AddAssign
    + SubAssign
    + MulAssign
    + DivAssign
{
    /// Result of a comparison, per lane.
    type Mask: Mask;

    /// Number of lanes.
    const LANES: usize;

    /// Whether it has derivatives, which iterations must bring to convergence as well.
    const HAS_DERIVATIVES: bool = false;

    /// Call `task` in a function of its own, compiled for processors with registers of this type, so that its code
    /// exists once for each type. `task` and all functions in it must be `#[inline(always)]`.
    fn in_one_function<R>(task: impl FnOnce() -> R) -> R;

    /// Broadcast `x` to all lanes.
    fn of(x: f64) -> Self;

    #[inline(always)]
    fn zero() -> Self {
        Self::of(0.0)
    }

    #[inline(always)]
    fn one() -> Self {
        Self::of(1.0)
    }

    /// One value per lane.
    fn from_lanes(of: impl Fn(usize) -> f64) -> Self;
    fn lane(&self, i: usize) -> f64;

    #[inline(always)]
    fn set_lane(&mut self, i: usize, x: f64) {
        *self = Self::select(Self::Mask::only(i), Self::of(x), *self);
    }

    /// The same value, as a constant for differentiation.
    #[inline(always)]
    fn detached(self) -> Self {
        self
    }

    fn abs(self) -> Self;
    /// False if either operand is NaN, as for all comparisons.
    fn lt(self, other: Self) -> Self::Mask;
    fn le(self, other: Self) -> Self::Mask;
    /// `yes` where the mask is true, else `no`.
    fn select(mask: Self::Mask, yes: Self, no: Self) -> Self;

    /// Sine and cosine of an angle from those of the angle reduced to the nearest quarter turn. The lowest
    /// bits of `shifted` hold the number of quarter turns.
    fn rotate_by_quadrant(shifted: Self, sin: Self, cos: Self) -> (Self, Self);

    /// Transpose arrays of numbers, one per lane, to an array of registers. Rows beyond the last lane are
    /// ignored.
    #[inline(always)]
    fn from_rows<const M: usize>(rows: &[&[f64; M]; MAX_LANES], columns: &mut [Self; M]) {
        for c in 0..M {
            columns[c] = Self::from_lanes(|i| rows[i][c]);
        }
    }

    /// Inverse of `from_rows`.
    #[inline(always)]
    fn to_rows<const M: usize>(columns: &[Self; M], rows: &mut [[f64; M]; MAX_LANES]) {
        for c in 0..M {
            for i in 0..Self::LANES {
                rows[i][c] = columns[c].lane(i);
            }
        }
    }

    #[inline(always)]
    fn ge(self, other: Self) -> Self::Mask {
        other.le(self)
    }

    /// The larger of two numbers; `other` if either is NaN.
    #[inline(always)]
    fn simd_max(self, other: Self) -> Self {
        Self::select(other.lt(self), self, other)
    }

    /// The smaller of two numbers; `other` if either is NaN.
    #[inline(always)]
    fn simd_min(self, other: Self) -> Self {
        Self::select(self.lt(other), self, other)
    }
}

/// Boolean per lane.
pub trait Mask: Copy + BitAnd<Output = Self> + BitOr<Output = Self> + Not<Output = Self> {
    fn of(x: bool) -> Self;
    fn from_lanes(of: impl Fn(usize) -> bool) -> Self;
    /// True in lane `i` only.
    fn only(i: usize) -> Self;
    fn lane(self, i: usize) -> bool;
    fn any(self) -> bool;

    #[inline(always)]
    fn all(self) -> bool {
        !(!self).any()
    }
}

impl Mask for bool {
    #[inline(always)]
    fn of(x: bool) -> Self {
        x
    }
    #[inline(always)]
    fn from_lanes(of: impl Fn(usize) -> bool) -> Self {
        of(0)
    }
    #[inline(always)]
    fn only(_: usize) -> Self {
        true
    }
    #[inline(always)]
    fn lane(self, _: usize) -> bool {
        self
    }
    #[inline(always)]
    fn any(self) -> bool {
        self
    }
}

impl Scalar for f64 {
    type Mask = bool;
    const LANES: usize = 1;

    #[inline(always)]
    fn in_one_function<R>(task: impl FnOnce() -> R) -> R {
        with_avx2(task)
    }
    #[inline(always)]
    fn of(x: f64) -> Self {
        x
    }
    #[inline(always)]
    fn from_lanes(of: impl Fn(usize) -> f64) -> Self {
        of(0)
    }
    #[inline(always)]
    fn lane(&self, _: usize) -> f64 {
        *self
    }
    #[inline(always)]
    fn abs(self) -> Self {
        f64::abs(self)
    }
    #[inline(always)]
    fn lt(self, other: Self) -> bool {
        self < other
    }
    #[inline(always)]
    fn le(self, other: Self) -> bool {
        self <= other
    }
    #[inline(always)]
    fn select(mask: bool, yes: Self, no: Self) -> Self {
        if mask { yes } else { no }
    }
    #[inline(always)]
    fn rotate_by_quadrant(shifted: Self, sin: Self, cos: Self) -> (Self, Self) {
        let quadrant = shifted.to_bits();
        // Odd quadrants exchange sine and cosine. The sine is negative in quadrants 2 and 3, the cosine in
        // 1 and 2.
        let odd = (quadrant & 1).wrapping_neg();
        let (s, c) = (sin.to_bits(), cos.to_bits());
        let exchange = (s ^ c) & odd;
        let sign = |quadrant: u64| (quadrant & 2) << 62;
        (
            f64::from_bits((s ^ exchange) ^ sign(quadrant)),
            f64::from_bits((c ^ exchange) ^ sign(quadrant.wrapping_add(1))),
        )
    }
}
