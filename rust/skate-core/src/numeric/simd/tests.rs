use crate::numeric::{
    scalar::{MAX_LANES, Mask, Scalar},
    simd::{Register, SimdTask, Width},
    trig::sin_cos,
};

/// Test values of many magnitudes, signs and classes, different for every `k`.
fn number(k: usize) -> f64 {
    let special = [0.0, -0.0, 1.0, -1.0, f64::INFINITY, f64::NAN, 1e300, 5e-324];
    let mixed = (k as u64 + 1).wrapping_mul(0x9e37_79b9_7f4a_7c15);
    match k % 5 {
        0 => special[k / 5 % special.len()],
        _ => ((mixed >> 12) as f64 / 2.0_f64.powi(52) - 0.5) * 10.0_f64.powi(k as i32 % 13 - 6),
    }
}

fn assert_same<T: Scalar>(lanes: T, alone: impl Fn(usize) -> f64, what: &str) {
    for i in 0..T::LANES {
        let (a, b) = (lanes.lane(i), alone(i));
        assert!(
            a.to_bits() == b.to_bits() || a.is_nan() && b.is_nan(),
            "{what}: {a} {b}"
        );
    }
}

/// Compare lanes with scalars.
struct LaneChecks;

impl SimdTask for LaneChecks {
    fn run_scalar(self) {
        check::<f64>();
    }

    fn run_simd<T: Register>(self) {
        T::with_target_features(
            #[inline(always)]
            || check::<T>(),
        );
    }
}

#[inline(always)]
fn check<T: Scalar>() {
    check_operations::<T>();
    check_transposition::<T, 3>();
    check_transposition::<T, 8>();
    check_transposition::<T, 19>();
}

#[inline(always)]
fn check_operations<T: Scalar>() {
    for k in 0..4000 {
        let (x, y) = (|i| number(k + 3 * i), |i| number(7 * k + i));
        let (a, b) = (T::from_lanes(x), T::from_lanes(y));
        assert_same(a + b, |i| x(i) + y(i), "+");
        assert_same(a - b, |i| x(i) - y(i), "-");
        assert_same(a * b, |i| x(i) * y(i), "*");
        assert_same(a / b, |i| x(i) / y(i), "/");
        assert_same(-a, |i| -x(i), "negation");
        assert_same(a.abs(), |i| x(i).abs(), "abs");
        let largest = |i| if y(i) < x(i) { x(i) } else { y(i) };
        assert_same(a.simd_max(b), largest, "max");
        let smallest = |i| if x(i) < y(i) { x(i) } else { y(i) };
        assert_same(a.simd_min(b), smallest, "min");
        for i in 0..T::LANES {
            assert_eq!(a.lt(b).lane(i), x(i) < y(i));
            assert_eq!(a.le(b).lane(i), x(i) <= y(i));
            assert_eq!(
                (!a.ge(b)).lane(i),
                y(i).partial_cmp(&x(i)).is_none_or(|order| order.is_gt())
            );
        }
        for i in 0..T::LANES {
            let mut changed = a;
            changed.set_lane(i, y(k));
            assert_same(changed, |j| if i == j { y(k) } else { x(j) }, "one lane");
        }
        let mut sin_cos_lanes = [(a, b)];
        sin_cos(&[a], &mut sin_cos_lanes);
        let alone = |i| {
            let mut one = [(0.0, 0.0)];
            sin_cos(&[x(i)], &mut one);
            one[0]
        };
        assert_same(sin_cos_lanes[0].0, |i| alone(i).0, "sine");
        assert_same(sin_cos_lanes[0].1, |i| alone(i).1, "cosine");
    }
}

/// `to_rows` inverts `from_rows`.
#[inline(always)]
fn check_transposition<T: Scalar, const M: usize>() {
    let rows: [[f64; M]; MAX_LANES] =
        std::array::from_fn(|i| std::array::from_fn(|c| (100 * i + c) as f64));
    let (mut columns, mut back) = ([T::zero(); M], [[0.0; M]; MAX_LANES]);
    T::from_rows(&rows.each_ref(), &mut columns);
    T::to_rows(&columns, &mut back);
    for c in 0..M {
        for i in 0..T::LANES {
            assert_eq!((columns[c].lane(i), back[i][c]), (rows[i][c], rows[i][c]));
        }
    }
}

#[test]
fn lanes_agree_with_scalars() {
    Width::all().for_each(|width| width.run(LaneChecks));
}
