//! One number, or a vector register full of them: what the equations of motion are written in.
//!
//! All operations of lanes are those of `f64`, lane by lane: no fused multiplications, no other order of
//! sums. A computation that takes no branches therefore gives every lane the very bits that it gives the
//! same numbers alone.

use std::{
    fmt::Debug,
    ops::{
        Add, AddAssign, BitAnd, BitOr, Div, DivAssign, Mul, MulAssign, Neg, Not, Sub, SubAssign,
    },
};

/// Most lanes that a register has.
pub const MAX_LANES: usize = 8;

/// See the module's documentation.
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
    /// Answers to a question, lane by lane.
    type Mask: Mask;

    /// How many numbers.
    const LANES: usize;

    /// The same number in all lanes.
    fn of(x: f64) -> Self;

    #[inline(always)]
    fn zero() -> Self {
        Self::of(0.0)
    }

    #[inline(always)]
    fn one() -> Self {
        Self::of(1.0)
    }

    /// A number for each lane.
    fn from_lanes(of: impl Fn(usize) -> f64) -> Self;
    fn lane(&self, i: usize) -> f64;

    #[inline(always)]
    fn set_lane(&mut self, i: usize, x: f64) {
        *self = Self::select(Self::Mask::only(i), Self::of(x), *self);
    }

    fn abs(self) -> Self;
    /// False where one is no number, as are all comparisons.
    fn lt(self, other: Self) -> Self::Mask;
    fn le(self, other: Self) -> Self::Mask;
    /// `yes` where the mask is true, else `no`.
    fn select(mask: Self::Mask, yes: Self, no: Self) -> Self;

    /// The sine and cosine of an angle from those of what its reduction to the nearest quarter turn left;
    /// the last bits of `shifted` count the quarter turns.
    fn rotate_by_quadrant(shifted: Self, sin: Self, cos: Self) -> (Self, Self);

    /// Arrays of numbers, one for each lane, as an array of lanes. Numbers that follow those of the last lane
    /// count for nothing.
    #[inline(always)]
    fn from_rows<const M: usize>(rows: &[&[f64; M]; MAX_LANES], columns: &mut [Self; M]) {
        for c in 0..M {
            columns[c] = Self::from_lanes(|i| rows[i][c]);
        }
    }

    /// The reverse.
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

    /// The larger of two numbers; the second where one is no number.
    #[inline(always)]
    fn simd_max(self, other: Self) -> Self {
        Self::select(other.lt(self), self, other)
    }

    /// The smaller of two numbers; the second where one is no number.
    #[inline(always)]
    fn simd_min(self, other: Self) -> Self {
        Self::select(self.lt(other), self, other)
    }
}

/// See `Scalar::Mask`.
pub trait Mask: Copy + BitAnd<Output = Self> + BitOr<Output = Self> + Not<Output = Self> {
    fn of(x: bool) -> Self;
    fn from_lanes(of: impl Fn(usize) -> bool) -> Self;
    /// True in one lane.
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
        // Odd quadrants exchange the two; the sine is negative in 2 and 3, the cosine in 1 and 2.
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
