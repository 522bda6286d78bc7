//! Random numbers with the same bits on every target.

use crate::numeric::elementary::{exp, ln};
use rand::{
    Rng,
    distr::{Distribution, Open01},
};
use std::sync::LazyLock;

/// Number of layers, of equal area, under the density of `normal`.
const LAYERS: usize = 256;
/// Where the tail begins, and the width of the layer with the tail.
const TAIL: f64 = 3.654_152_885_361_009;
const WIDEST: f64 = 3.910_757_959_537_09;

/// Widths of the layers from the bottom to the top.
static WIDTHS: LazyLock<[f64; LAYERS + 1]> = LazyLock::new(|| {
    let area = WIDEST * density(TAIL);
    let mut widths = [WIDEST; LAYERS + 1];
    widths[1] = TAIL;
    for i in 2..LAYERS {
        let x = widths[i - 1];
        widths[i] = (-2.0 * ln(area / x + density(x))).sqrt();
    }
    widths[LAYERS] = 0.0;
    widths
});

/// Initialise what is otherwise initialised on first use.
pub fn initialise_statics() {
    LazyLock::force(&WIDTHS);
}

/// Density of the standard normal distribution, times a constant.
fn density(x: f64) -> f64 {
    exp(-x * x / 2.0)
}

/// Standard normal deviate by the ziggurat algorithm (Marsaglia and Tsang 2000). These are the numbers of the crate
/// `rand_distr`, whose logarithm and exponential are those of the system.
pub fn normal(rng: &mut impl Rng) -> f64 {
    loop {
        // The layer and a number in [-1, 1) from different bits.
        let bits = rng.next_u64();
        let i = (bits & 0xff) as usize;
        let u = f64::from_bits((bits >> 12) | 0x4000_0000_0000_0000) - 3.0;
        let x = u * WIDTHS[i];
        if x.abs() < WIDTHS[i + 1] {
            return x;
        }
        if i == 0 {
            return tail(rng).copysign(u);
        }
        let [low, high] = [WIDTHS[i], WIDTHS[i + 1]].map(density);
        if high + (low - high) * rng.random::<f64>() < density(x) {
            return x;
        }
    }
}

/// A deviate beyond the tail's beginning.
fn tail(rng: &mut impl Rng) -> f64 {
    loop {
        let [x, y] = [(); 2].map(|()| ln(Open01.sample(rng)));
        let x = x / TAIL;
        if -2.0 * y >= x * x {
            return TAIL - x;
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::numeric::checksum::checksum;
    use rand::SeedableRng;
    use rand_chacha::ChaCha8Rng;

    /// Moments of a standard normal distribution, in standard errors of each, and bits that no target may change.
    #[test]
    fn normal_deviates() {
        let n = 400_000;
        let mut rng = ChaCha8Rng::seed_from_u64(2);
        let (mut sums, mut bytes, mut in_tail) = ([0.0; 4], Vec::new(), 0);
        for _ in 0..n {
            let x = normal(&mut rng);
            bytes.extend(x.to_le_bytes());
            in_tail += u32::from(x.abs() > TAIL);
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
        // Measured 1.7, and 103 in the tail as expected.
        assert!(
            worst < 4.0 && (70..140).contains(&in_tail),
            "{worst} {in_tail}"
        );
        assert_eq!(checksum(&bytes), 0xf082_b6c4_c037_c7ab);
    }
}
