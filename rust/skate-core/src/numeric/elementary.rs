//! Elementary functions that IEEE 754 does not round exactly, with the same bits on every target.
//!
//! The standard library calls the system's mathematical library, whose last bit depends on the system and, with glibc,
//! on whether the processor has fused multiply-add. The crate `libm` uses additions and multiplications only. Square
//! roots and roundings to integers are exact everywhere. Sines and cosines are in `trig`.

pub use libm::{exp, exp2, hypot, log as ln, log2, pow};

#[cfg(test)]
mod tests {
    use super::*;

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
        assert_eq!(sum, 0xb5bc_4b57_fce9_8a2e, "{sum:#x}");
    }
}
