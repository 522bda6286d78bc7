//! Parts of an evaluation on dual numbers, compiled once.

use crate::{
    contact::equations::{Slip, Solution},
    derivatives::dual::Varied,
    model::{contact_mode::ContactMode, layout::NV},
    numeric::{dual::Dual, simd::with_avx2},
    rhs::{Evaluation, Stance},
};
use nalgebra::Vector3;

/// Kinematics at (q, v) in the frame of `mode`.
#[inline(never)]
pub fn update(
    eval: &mut Evaluation<Dual<f64>>,
    models: Varied<'_>,
    mode: ContactMode,
    (q, v): (&[Dual<f64>; NV], &[Dual<f64>; NV]),
) {
    with_avx2(
        #[inline(always)]
        || eval.update_kinematics(models, &Stance::of(models, mode), q, v),
    );
}

/// Solution of the contact problem; false, and not a number, where constraints depend on each other.
#[inline(never)]
pub fn solve(
    eval: &mut Evaluation<Dual<f64>>,
    mode: ContactMode,
    slip: Slip<Dual<f64>>,
) -> (Solution<Dual<f64>>, bool) {
    with_avx2(
        #[inline(always)]
        || eval.factored.problem.regular_compact(mode, slip),
    )
}

/// Motion of all coordinates caused by a motion of the root and impulses on the free foot.
#[inline(never)]
pub fn response(
    eval: &mut Evaluation<Dual<f64>>,
    models: Varied<'_>,
    (root, lam): (&Vector3<Dual<f64>>, &Vector3<Dual<f64>>),
) -> [Dual<f64>; NV] {
    with_avx2(
        #[inline(always)]
        || *eval.response(models, root, lam),
    )
}

/// Factor of M and the contact problem.
#[inline(never)]
pub fn factor(eval: &mut Evaluation<Dual<f64>>, models: Varied<'_>, rows: usize) {
    with_avx2(
        #[inline(always)]
        || eval.factor(models, rows, None),
    );
}
