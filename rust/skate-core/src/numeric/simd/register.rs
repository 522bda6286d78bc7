//! SIMD registers as `Scalar`. All methods are inlined and consist of one or two instructions. A register
//! has the memory layout of an array of its lanes.

#[cfg(target_arch = "x86_64")]
use crate::numeric::scalar::MAX_LANES;
use crate::numeric::{
    scalar::{Mask, Scalar},
    simd::Register,
};
use std::ops::{
    Add, AddAssign, BitAnd, BitOr, Div, DivAssign, Mul, MulAssign, Neg, Not, Sub, SubAssign,
};

#[cfg(target_arch = "aarch64")]
use std::arch::aarch64::*;
#[cfg(target_arch = "x86_64")]
use std::arch::x86_64::*;

/// Implements a binary operator and its assigning form.
macro_rules! operator {
    ($name:ident, $trait:ident, $method:ident, $assign:ident, $assign_method:ident, $intrinsic:ident) => {
        impl $trait for $name {
            type Output = Self;
            #[inline(always)]
            fn $method(self, other: Self) -> Self {
                // SAFETY: a value of this type exists only on processors that have such registers.
                Self(unsafe { $intrinsic(self.0, other.0) })
            }
        }
        impl $assign for $name {
            #[inline(always)]
            fn $assign_method(&mut self, other: Self) {
                *self = $trait::$method(*self, other);
            }
        }
    };
}

/// Implements `Scalar` for a register of `n` numbers.
macro_rules! register {
    (
        $(#[$doc:meta])* $name:ident($raw:ty) * $n:literal, lanes $($lane:literal)*, $mask:ident,
        add $add:ident, sub $sub:ident, mul $mul:ident, div $div:ident,
        splat $splat:ident,
        abs |$a:ident| $abs:expr, neg |$g:ident| $neg:expr,
        lt |$la:ident, $lb:ident| $lt:expr, le |$ea:ident, $eb:ident| $le:expr,
        select |$m:ident, $yes:ident, $no:ident| $select:expr,
        quadrant |$shifted:ident, $sin:ident, $cos:ident| $quadrant:expr
        $(, $more:item)*
    ) => {
        $(#[$doc])*
        #[derive(Debug, Clone, Copy)]
        #[repr(transparent)]
        pub struct $name($raw);

        operator!($name, Add, add, AddAssign, add_assign, $add);
        operator!($name, Sub, sub, SubAssign, sub_assign, $sub);
        operator!($name, Mul, mul, MulAssign, mul_assign, $mul);
        operator!($name, Div, div, DivAssign, div_assign, $div);

        impl Neg for $name {
            type Output = Self;
            #[inline(always)]
            fn neg(self) -> Self {
                let $g = self.0;
                Self(unsafe { $neg })
            }
        }

        impl $name {
            #[inline(always)]
            fn array(self) -> [f64; $n] {
                // SAFETY: the register and the array have the same size and lane order.
                unsafe { std::mem::transmute(self) }
            }
        }

        impl Default for $name {
            #[inline(always)]
            fn default() -> Self {
                Self::of(0.0)
            }
        }

        impl PartialEq for $name {
            fn eq(&self, other: &Self) -> bool {
                self.array() == other.array()
            }
        }

        impl Scalar for $name {
            type Mask = $mask;
            const LANES: usize = $n;

            #[inline(always)]
            fn in_one_function<R>(task: impl FnOnce() -> R) -> R {
                Self::with_target_features(task)
            }
            #[inline(always)]
            fn of(x: f64) -> Self {
                Self(unsafe { $splat(x) })
            }
            #[inline(always)]
            fn from_lanes(of: impl Fn(usize) -> f64) -> Self {
                // `array::from_fn` costs the compiler more, in some thousand places.
                let lanes: [f64; $n] = [$(of($lane)),*];
                // SAFETY: the register and the array have the same size and lane order.
                unsafe { std::mem::transmute(lanes) }
            }
            #[inline(always)]
            fn lane(&self, i: usize) -> f64 {
                // SAFETY: the register and the array have the same size and lane order, and the register's
                // alignment is at least the array's.
                let lanes: &[f64; $n] = unsafe { &*std::ptr::from_ref(self).cast() };
                lanes[i]
            }
            #[inline(always)]
            fn abs(self) -> Self {
                let $a = self.0;
                Self(unsafe { $abs })
            }
            #[inline(always)]
            fn lt(self, other: Self) -> $mask {
                let ($la, $lb) = (self.0, other.0);
                $mask(unsafe { $lt })
            }
            #[inline(always)]
            fn le(self, other: Self) -> $mask {
                let ($ea, $eb) = (self.0, other.0);
                $mask(unsafe { $le })
            }
            #[inline(always)]
            fn select(mask: $mask, yes: Self, no: Self) -> Self {
                let ($m, $yes, $no) = (mask.0, yes.0, no.0);
                Self(unsafe { $select })
            }
            #[inline(always)]
            fn rotate_by_quadrant(shifted: Self, sin: Self, cos: Self) -> (Self, Self) {
                let ($shifted, $sin, $cos) = (shifted.0, sin.0, cos.0);
                let (sin, cos) = unsafe { $quadrant };
                (Self(sin), Self(cos))
            }
            $($more)*
        }
    };
}

/// Implements a mask from three operations and its bits.
macro_rules! mask {
    (
        $name:ident($raw:ty) * $n:literal,
        and |$aa:ident, $ab:ident| $and:expr, or |$oa:ident, $ob:ident| $or:expr, not |$na:ident| $not:expr,
        bits |$ba:ident| $bits:expr, make |$ma:ident| $make:expr
    ) => {
        /// Mask of the register above.
        #[derive(Debug, Clone, Copy)]
        #[repr(transparent)]
        pub struct $name($raw);

        impl BitAnd for $name {
            type Output = Self;
            #[inline(always)]
            fn bitand(self, other: Self) -> Self {
                let ($aa, $ab) = (self.0, other.0);
                #[allow(unused_unsafe)]
                Self(unsafe { $and })
            }
        }
        impl BitOr for $name {
            type Output = Self;
            #[inline(always)]
            fn bitor(self, other: Self) -> Self {
                let ($oa, $ob) = (self.0, other.0);
                #[allow(unused_unsafe)]
                Self(unsafe { $or })
            }
        }
        impl Not for $name {
            type Output = Self;
            #[inline(always)]
            fn not(self) -> Self {
                let $na = self.0;
                #[allow(unused_unsafe)]
                Self(unsafe { $not })
            }
        }
        impl Mask for $name {
            #[inline(always)]
            fn of(x: bool) -> Self {
                Self::from_lanes(|_| x)
            }
            #[inline(always)]
            fn from_lanes(of: impl Fn(usize) -> bool) -> Self {
                let mut $ma = 0_u8;
                for i in 0..$n {
                    $ma |= u8::from(of(i)) << i;
                }
                #[allow(unused_unsafe)]
                Self(unsafe { $make })
            }
            #[inline(always)]
            fn only(i: usize) -> Self {
                let $ma = 1_u8 << i;
                #[allow(unused_unsafe)]
                Self(unsafe { $make })
            }
            #[inline(always)]
            fn lane(self, i: usize) -> bool {
                let $ba = self.0;
                #[allow(unused_unsafe)]
                let bits: u8 = unsafe { $bits };
                bits >> i & 1 == 1
            }
            #[inline(always)]
            fn any(self) -> bool {
                let $ba = self.0;
                #[allow(unused_unsafe)]
                let bits: u8 = unsafe { $bits };
                bits != 0
            }
        }
    };
}

#[cfg(target_arch = "x86_64")]
register!(
    /// AVX-512: eight lanes.
    F64x8(__m512d) * 8, lanes 0 1 2 3 4 5 6 7, MaskX8,
    add _mm512_add_pd, sub _mm512_sub_pd, mul _mm512_mul_pd, div _mm512_div_pd,
    splat _mm512_set1_pd,
    abs |a| _mm512_abs_pd(a), neg |a| _mm512_xor_pd(a, _mm512_set1_pd(-0.0)),
    lt |a, b| _mm512_cmp_pd_mask::<_CMP_LT_OQ>(a, b), le |a, b| _mm512_cmp_pd_mask::<_CMP_LE_OQ>(a, b),
    select |mask, yes, no| _mm512_mask_blend_pd(mask, no, yes),
    quadrant |shifted, sin, cos| {
        let q = _mm512_castpd_si512(shifted);
        let one = _mm512_set1_epi64(1);
        let two = _mm512_set1_epi64(2);
        let odd = _mm512_test_epi64_mask(q, one);
        let s = _mm512_slli_epi64::<62>(_mm512_and_si512(q, two));
        let c = _mm512_slli_epi64::<62>(_mm512_and_si512(_mm512_add_epi64(q, one), two));
        (
            _mm512_xor_pd(_mm512_mask_blend_pd(odd, sin, cos), _mm512_castsi512_pd(s)),
            _mm512_xor_pd(_mm512_mask_blend_pd(odd, cos, sin), _mm512_castsi512_pd(c)),
        )
    },
    #[inline(always)]
    fn from_rows<const M: usize>(rows: &[&[f64; M]; MAX_LANES], columns: &mut [Self; M]) {
        let mut c = 0;
        while c < M {
            // The last block of eight may overlap the previous one.
            let from = if c + 8 <= M || M < 8 { c } else { M - 8 };
            let mut block = [Self::zero(); 8];
            for (block, row) in block.iter_mut().zip(rows) {
                *block = Self::from_lanes(|i| if from + i < M { row[from + i] } else { 0.0 });
            }
            let block = transpose(block);
            for i in 0..8 {
                if from + i < M {
                    columns[from + i] = block[i];
                }
            }
            c += 8;
        }
    },
    #[inline(always)]
    fn to_rows<const M: usize>(columns: &[Self; M], rows: &mut [[f64; M]; MAX_LANES]) {
        let mut c = 0;
        while c < M {
            let from = if c + 8 <= M || M < 8 { c } else { M - 8 };
            let mut block = [Self::zero(); 8];
            for i in 0..8 {
                if from + i < M {
                    block[i] = columns[from + i];
                }
            }
            let block = transpose(block);
            for (row, block) in rows.iter_mut().zip(block) {
                let lanes = block.array();
                for i in 0..8 {
                    if from + i < M {
                        row[from + i] = lanes[i];
                    }
                }
            }
            c += 8;
        }
    }
);

/// Transpose of an 8 x 8 matrix of rows.
#[cfg(target_arch = "x86_64")]
#[inline(always)]
fn transpose(rows: [F64x8; 8]) -> [F64x8; 8] {
    let [a, b, c, d, e, f, g, h] = rows.map(|row| row.0);
    // SAFETY: a value of this type exists only on processors that have such registers.
    unsafe {
        // Interleave pairs of rows, then pairs of pairs, then all.
        let even = [
            _mm512_unpacklo_pd(a, b),
            _mm512_unpacklo_pd(c, d),
            _mm512_unpacklo_pd(e, f),
            _mm512_unpacklo_pd(g, h),
        ];
        let odd = [
            _mm512_unpackhi_pd(a, b),
            _mm512_unpackhi_pd(c, d),
            _mm512_unpackhi_pd(e, f),
            _mm512_unpackhi_pd(g, h),
        ];
        let mut out = rows;
        for (first, [a, b, c, d]) in [(0, even), (1, odd)] {
            let (near_ab, far_ab) = (
                _mm512_shuffle_f64x2::<0x88>(a, b),
                _mm512_shuffle_f64x2::<0xdd>(a, b),
            );
            let (near_cd, far_cd) = (
                _mm512_shuffle_f64x2::<0x88>(c, d),
                _mm512_shuffle_f64x2::<0xdd>(c, d),
            );
            out[first] = F64x8(_mm512_shuffle_f64x2::<0x88>(near_ab, near_cd));
            out[first + 2] = F64x8(_mm512_shuffle_f64x2::<0x88>(far_ab, far_cd));
            out[first + 4] = F64x8(_mm512_shuffle_f64x2::<0xdd>(near_ab, near_cd));
            out[first + 6] = F64x8(_mm512_shuffle_f64x2::<0xdd>(far_ab, far_cd));
        }
        out
    }
}

#[cfg(target_arch = "x86_64")]
mask!(
    MaskX8(__mmask8) * 8,
    and | a,
    b | a & b,
    or | a,
    b | a | b,
    not | a | !a,
    bits | a | a,
    make | bits | bits
);

#[cfg(target_arch = "x86_64")]
register!(
    /// AVX2: four lanes.
    F64x4(__m256d) * 4, lanes 0 1 2 3, MaskX4,
    add _mm256_add_pd, sub _mm256_sub_pd, mul _mm256_mul_pd, div _mm256_div_pd,
    splat _mm256_set1_pd,
    abs |a| _mm256_andnot_pd(_mm256_set1_pd(-0.0), a),
    neg |a| _mm256_xor_pd(a, _mm256_set1_pd(-0.0)),
    lt |a, b| _mm256_cmp_pd::<_CMP_LT_OQ>(a, b), le |a, b| _mm256_cmp_pd::<_CMP_LE_OQ>(a, b),
    select |mask, yes, no| _mm256_blendv_pd(no, yes, mask),
    quadrant |shifted, sin, cos| {
        let q = _mm256_castpd_si256(shifted);
        let one = _mm256_set1_epi64x(1);
        let two = _mm256_set1_epi64x(2);
        // The blend selects by the highest bit.
        let odd = _mm256_castsi256_pd(_mm256_slli_epi64::<63>(q));
        let s = _mm256_slli_epi64::<62>(_mm256_and_si256(q, two));
        let c = _mm256_slli_epi64::<62>(_mm256_and_si256(_mm256_add_epi64(q, one), two));
        (
            _mm256_xor_pd(_mm256_blendv_pd(sin, cos, odd), _mm256_castsi256_pd(s)),
            _mm256_xor_pd(_mm256_blendv_pd(cos, sin, odd), _mm256_castsi256_pd(c)),
        )
    }
);
#[cfg(target_arch = "x86_64")]
mask!(
    MaskX4(__m256d) * 4,
    and | a,
    b | _mm256_and_pd(a, b),
    or | a,
    b | _mm256_or_pd(a, b),
    not | a | _mm256_xor_pd(a, _mm256_castsi256_pd(_mm256_set1_epi64x(-1))),
    bits | a | _mm256_movemask_pd(a) as u8,
    make | bits | {
        let lane = |i: u8| -i64::from(bits >> i & 1);
        _mm256_castsi256_pd(_mm256_set_epi64x(lane(3), lane(2), lane(1), lane(0)))
    }
);

#[cfg(target_arch = "aarch64")]
register!(
    /// NEON: two lanes; every aarch64 processor has it.
    F64x2(float64x2_t) * 2, lanes 0 1, MaskX2,
    add vaddq_f64, sub vsubq_f64, mul vmulq_f64, div vdivq_f64,
    splat vdupq_n_f64,
    abs |a| vabsq_f64(a), neg |a| vnegq_f64(a),
    lt |a, b| vcltq_f64(a, b), le |a, b| vcleq_f64(a, b),
    select |mask, yes, no| vbslq_f64(mask, yes, no),
    quadrant |shifted, sin, cos| {
        let q = vreinterpretq_u64_f64(shifted);
        let odd = vtstq_u64(q, vdupq_n_u64(1));
        let next = vaddq_u64(q, vdupq_n_u64(1));
        let s = vshlq_n_u64::<62>(vandq_u64(q, vdupq_n_u64(2)));
        let c = vshlq_n_u64::<62>(vandq_u64(next, vdupq_n_u64(2)));
        let sine = vreinterpretq_u64_f64(vbslq_f64(odd, cos, sin));
        let cosine = vreinterpretq_u64_f64(vbslq_f64(odd, sin, cos));
        (
            vreinterpretq_f64_u64(veorq_u64(sine, s)),
            vreinterpretq_f64_u64(veorq_u64(cosine, c)),
        )
    }
);
#[cfg(target_arch = "aarch64")]
mask!(
    MaskX2(uint64x2_t) * 2,
    and | a,
    b | vandq_u64(a, b),
    or | a,
    b | vorrq_u64(a, b),
    not | a | veorq_u64(a, vdupq_n_u64(u64::MAX)),
    bits | a | (vgetq_lane_u64::<0>(a) & 1 | (vgetq_lane_u64::<1>(a) & 1) << 1) as u8,
    make | bits | {
        let lane = |i: u8| u64::from(bits >> i & 1).wrapping_neg();
        vcombine_u64(vcreate_u64(lane(0)), vcreate_u64(lane(1)))
    }
);
