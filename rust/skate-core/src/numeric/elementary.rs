//! Elementary functions that IEEE 754 does not round exactly, with the same bits on every target.
//!
//! The standard library calls the system's mathematical library, whose last bit depends on the system and, with glibc,
//! on whether the processor has fused multiply-add. The crate `libm` uses additions and multiplications only. Square
//! roots and roundings to integers are exact everywhere. Sines and cosines are in `trig`.

pub use libm::{exp, exp2, hypot, log as ln, log2, pow};

use rand::Rng;

/// Standard normal deviate by the polar method (Marsaglia and Bray 1964).
pub fn normal(rng: &mut impl Rng) -> f64 {
    loop {
        let [x, y] = [(); 2].map(|()| 2.0 * rng.random::<f64>() - 1.0);
        let square = x * x + y * y;
        if square > 0.0 && square < 1.0 {
            return x * (-2.0 * ln(square) / square).sqrt();
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use rand::SeedableRng;
    use rand_chacha::ChaCha8Rng;

    /// Values that the mathematical libraries of systems round differently, as bits: no target may change one.
    #[test]
    fn bits_are_the_same_on_every_target() {
        let mut sum = 0_u64;
        for i in 1..20_000 {
            let x = f64::from(i) * 1.7e-3;
            let y = 0.011 * f64::from(i % 997) - 5.0;
            for value in [exp(y), exp2(y), hypot(x, y), ln(x), log2(x), pow(x, y)] {
                sum = sum.rotate_left(5) ^ value.to_bits();
            }
        }
        let mut rng = ChaCha8Rng::seed_from_u64(1);
        for _ in 0..20_000 {
            sum = sum.rotate_left(5) ^ normal(&mut rng).to_bits();
        }
        assert_eq!(sum, 0xeaa3_e5b8_e4b8_51c3, "{sum:#x}");
    }

    /// Moments of a standard normal distribution, in standard errors of each.
    #[test]
    fn moments_of_normal_deviates() {
        let n = 400_000;
        let mut rng = ChaCha8Rng::seed_from_u64(2);
        let mut sums = [0.0; 4];
        for _ in 0..n {
            let x = normal(&mut rng);
            let mut power = 1.0;
            for sum in &mut sums {
                power *= x;
                *sum += power;
            }
        }
        let n = f64::from(n);
        let of_powers = [(0.0, 1.0), (1.0, 2.0), (0.0, 15.0), (3.0, 96.0)];
        let errors = sums.into_iter().zip(of_powers);
        let errors =
            errors.map(|(sum, (mean, variance))| (sum / n - mean) / f64::sqrt(variance / n));
        let worst = errors.fold(0.0, |so_far: f64, error| so_far.max(error.abs()));
        // Measured 0.9.
        assert!(worst < 4.0, "{worst}");
    }
}
