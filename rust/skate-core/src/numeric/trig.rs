//! Sines and cosines, mostly of all angles at once. The code has no calls and no branches, so the compiler
//! vectorises it, and the result does not depend on the system's mathematical library.
//!
//! Reduction to [-pi/4, pi/4] in three parts (Cody and Waite 1980), polynomials of FreeBSD's msun
//! (`k_sin.c`, `k_cos.c`, Sun Microsystems 1993), error about one unit in the last place.

use crate::numeric::scalar::{Mask, Scalar};
use std::f64::consts::{PI, TAU};

/// pi / 2 in three parts. The first two have 33 bits, so that their products with small integers are exact.
const PI_2: [f64; 3] = [
    f64::from_bits(0x3FF9_21FB_5440_0000),
    f64::from_bits(0x3DD0_B461_1A60_0000),
    f64::from_bits(0x3BA3_198A_2E03_7073),
];
/// Adding this constant rounds to an integer and leaves it in the lowest bits: 1.5 * 2^52.
const ROUND_TO_INTEGER: f64 = 6_755_399_441_055_744.0;
/// Largest angle for which the reduction is accurate [rad].
const MAX_REDUCED: f64 = 1e5;

// All digits as printed in msun.
#[allow(clippy::excessive_precision)]
const S: [f64; 6] = [
    -1.66666666666666324348e-01,
    8.33333333332248946124e-03,
    -1.98412698298579493134e-04,
    2.75573137070700676789e-06,
    -2.50507602534068634195e-08,
    1.58969099521155010221e-10,
];
#[allow(clippy::excessive_precision)]
const C: [f64; 6] = [
    4.16666666666666019037e-02,
    -1.38888888888741095749e-03,
    2.48015872894767294178e-05,
    -2.75573143513906633035e-07,
    2.08757232129817482790e-09,
    -1.13596475577881948265e-11,
];

#[inline(always)]
fn horner<T: Scalar>(z: T, coefficients: &[f64; 6]) -> T {
    let mut sum = T::of(coefficients[5]);
    for i in (0..5).rev() {
        sum = T::of(coefficients[i]) + z * sum;
    }
    sum
}

#[inline(always)]
fn one<T: Scalar>(x: T) -> (T, T) {
    let shifted = x.detached() * T::of(std::f64::consts::FRAC_2_PI) + T::of(ROUND_TO_INTEGER);
    let k = shifted - T::of(ROUND_TO_INTEGER);
    let (a, b, c) = (T::of(PI_2[0]), T::of(PI_2[1]), T::of(PI_2[2]));
    let r = ((x - k * a) - k * b) - k * c;
    let z = r * r;
    let one = T::one();
    let s = horner(z, &S);
    let sin = r + r * z * s;
    let c = horner(z, &C);
    let half = T::of(0.5) * z;
    let near = one - half;
    let cos = near + (((one - near) - half) + z * z * c);
    T::rotate_by_quadrant(shifted, sin, cos)
}

/// Maximum number of angles per call of `sin_cos`.
pub const MAX_ANGLES: usize = 17;

/// Sines and cosines of at most `MAX_ANGLES` angles [rad].
#[inline(always)]
pub fn sin_cos<T: Scalar>(angles: &[T], out: &mut [(T, T)]) {
    let n = angles.len().min(out.len()).min(MAX_ANGLES);
    let mut exact = T::Mask::of(true);
    for x in &angles[..n] {
        exact = exact & x.abs().le(T::of(MAX_REDUCED));
    }
    if T::LANES == 1 {
        // Local arrays cannot alias the arguments, which lets the compiler vectorise this loop.
        let (mut x, mut sin, mut cos) = (
            [T::zero(); MAX_ANGLES],
            [T::zero(); MAX_ANGLES],
            [T::zero(); MAX_ANGLES],
        );
        x[..n].copy_from_slice(&angles[..n]);
        for i in 0..n {
            (sin[i], cos[i]) = one(x[i]);
        }
        for i in 0..n {
            out[i] = (sin[i], cos[i]);
        }
    } else {
        for i in 0..n {
            out[i] = one(angles[i]);
        }
    }
    if !exact.all() {
        sin_cos_far(angles, out);
    }
}

/// Sine and cosine of one angle.
#[inline(always)]
pub fn sin_cos_of<T: Scalar>(x: T) -> (T, T) {
    let mut out = [one(x)];
    if !x.abs().le(T::of(MAX_REDUCED)).all() {
        sin_cos_far(&[x], &mut out);
    }
    out[0]
}

/// For angles beyond `MAX_REDUCED` and NaN.
#[cold]
#[inline(never)]
fn sin_cos_far<T: Scalar>(angles: &[T], out: &mut [(T, T)]) {
    for (x, (sin, cos)) in angles.iter().zip(out) {
        for i in 0..T::LANES {
            let x = x.lane(i);
            if x.is_nan() || x.abs() > MAX_REDUCED {
                let (s, c) = libm::sincos(x);
                sin.set_lane(i, s);
                cos.set_lane(i, c);
            }
        }
    }
}

/// The same angle in [-pi, pi], for joints without stop, which may rotate by more than a turn.
#[inline(always)]
pub fn wrap_angle<T: Scalar>(angle: T) -> T {
    angle - T::from_lanes(|i| TAU * (angle.lane(i) / TAU).round())
}

/// The multiple of pi nearest to an angle: that of a flat sole, which may lie upside down.
#[inline(always)]
pub fn nearest_half_turn<T: Scalar>(angle: T) -> T {
    T::from_lanes(|i| match angle.lane(i) {
        small if small.abs() < 1.0 => 0.0,
        angle => PI * (angle / PI).round(),
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn sin_cos_agrees_with_the_standard_library() {
        let mut out = [(0.0, 0.0); MAX_ANGLES];
        let mut worst: f64 = 0.0;
        for i in 0..200_000 {
            let mut angles = [0.0; MAX_ANGLES];
            for (b, x) in angles.iter_mut().enumerate() {
                let u = f64::from(i * 17 + b as i32) / 3_400_000.0;
                *x = (u - 0.5) * [0.1, 3.0, 20.0, 1e4, 1.9e5][b % 5];
            }
            angles[0] = [0.0, f64::NAN, 1e300, f64::INFINITY][i as usize % 4];
            sin_cos(&angles, &mut out);
            for (x, (s, c)) in angles.iter().zip(out) {
                let (sin, cos) = x.sin_cos();
                assert!(s.is_nan() == sin.is_nan());
                worst = worst.max((s - sin).abs()).max((c - cos).abs());
                let alone = sin_cos_of(*x);
                assert!(alone == (s, c) || s.is_nan() && alone.0.is_nan());
            }
        }
        // Measured 1.2e-16.
        assert!(worst < 3e-16, "{worst:e}");
    }
}
