//! Operations on 3-vectors and 3 x 3 matrices of lanes. nalgebra's operators are not always inlined, and
//! calls pass registers through memory. The sums have the same order as nalgebra's.

use crate::numeric::scalar::Scalar;
use nalgebra::{Matrix3, Vector3};

#[inline(always)]
pub fn zero<T: Scalar>() -> Vector3<T> {
    Vector3::new(T::zero(), T::zero(), T::zero())
}

#[inline(always)]
pub fn zeros<T: Scalar>() -> Matrix3<T> {
    let z = T::zero();
    Matrix3::new(z, z, z, z, z, z, z, z, z)
}

#[inline(always)]
pub fn add<T: Scalar>(a: &Vector3<T>, b: &Vector3<T>) -> Vector3<T> {
    Vector3::new(a[0] + b[0], a[1] + b[1], a[2] + b[2])
}

#[inline(always)]
pub fn sub<T: Scalar>(a: &Vector3<T>, b: &Vector3<T>) -> Vector3<T> {
    Vector3::new(a[0] - b[0], a[1] - b[1], a[2] - b[2])
}

/// Component-wise product.
#[inline(always)]
pub fn mul<T: Scalar>(a: &Vector3<T>, b: &Vector3<T>) -> Vector3<T> {
    Vector3::new(a[0] * b[0], a[1] * b[1], a[2] * b[2])
}

#[inline(always)]
pub fn scale<T: Scalar>(a: &Vector3<T>, by: T) -> Vector3<T> {
    Vector3::new(a[0] * by, a[1] * by, a[2] * by)
}

#[inline(always)]
pub fn cross<T: Scalar>(a: &Vector3<T>, b: &Vector3<T>) -> Vector3<T> {
    Vector3::new(
        a[1] * b[2] - a[2] * b[1],
        a[2] * b[0] - a[0] * b[2],
        a[0] * b[1] - a[1] * b[0],
    )
}

#[inline(always)]
pub fn dot<T: Scalar>(a: &Vector3<T>, b: &Vector3<T>) -> T {
    a[0] * b[0] + a[1] * b[1] + a[2] * b[2]
}

/// M v
#[inline(always)]
pub fn apply<T: Scalar>(m: &Matrix3<T>, v: &Vector3<T>) -> Vector3<T> {
    let mut out = zero();
    for i in 0..3 {
        out[i] = m[(i, 0)] * v[0] + m[(i, 1)] * v[1] + m[(i, 2)] * v[2];
    }
    out
}

/// M^T v
#[inline(always)]
pub fn apply_transposed<T: Scalar>(m: &Matrix3<T>, v: &Vector3<T>) -> Vector3<T> {
    let mut out = zero();
    for i in 0..3 {
        out[i] = m[(0, i)] * v[0] + m[(1, i)] * v[1] + m[(2, i)] * v[2];
    }
    out
}

/// A B
#[inline(always)]
pub fn product<T: Scalar>(a: &Matrix3<T>, b: &Matrix3<T>) -> Matrix3<T> {
    let mut out = zeros();
    for i in 0..3 {
        for j in 0..3 {
            out[(i, j)] = a[(i, 0)] * b[(0, j)] + a[(i, 1)] * b[(1, j)] + a[(i, 2)] * b[(2, j)];
        }
    }
    out
}

/// A B^T
#[inline(always)]
pub fn product_transposed<T: Scalar>(a: &Matrix3<T>, b: &Matrix3<T>) -> Matrix3<T> {
    let mut out = zeros();
    for i in 0..3 {
        for j in 0..3 {
            out[(i, j)] = a[(i, 0)] * b[(j, 0)] + a[(i, 1)] * b[(j, 1)] + a[(i, 2)] * b[(j, 2)];
        }
    }
    out
}

/// a += b
#[inline(always)]
pub fn add_assign<T: Scalar>(a: &mut Matrix3<T>, b: &Matrix3<T>) {
    for i in 0..3 {
        for j in 0..3 {
            a[(i, j)] += b[(i, j)];
        }
    }
}

/// a -= b
#[inline(always)]
pub fn sub_assign<T: Scalar>(a: &mut Matrix3<T>, b: &Matrix3<T>) {
    for i in 0..3 {
        for j in 0..3 {
            a[(i, j)] -= b[(i, j)];
        }
    }
}
