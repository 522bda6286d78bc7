//! Numbers from bytes. Missing bytes count as zero.

use arbitrary::Unstructured;
use skate_core::{
    model::layout::NV,
    numeric::elementary::{exp, ln},
};

/// One byte.
pub fn byte(u: &mut Unstructured) -> u8 {
    u.arbitrary().unwrap_or(0)
}

/// An integer below `n` (at most 256).
pub fn below(u: &mut Unstructured, n: usize) -> usize {
    byte(u) as usize % n
}

/// A fraction in [0, 1], in 65,536 steps.
fn unit_fraction(u: &mut Unstructured) -> f64 {
    f64::from(u.arbitrary::<u16>().unwrap_or(0)) / f64::from(u16::MAX)
}

/// Log-uniform in [low, high]; `low` > 0.
pub fn logarithmic(u: &mut Unstructured, low: f64, high: f64) -> f64 {
    exp(ln(low) + unit_fraction(u) * ln(high / low)).clamp(low, high)
}

/// In [low, high]: one of the ends, the old value, a value near it, or any value.
pub fn near_or_within(u: &mut Unstructured, old: f64, low: f64, high: f64) -> f64 {
    let x = match below(u, 6) {
        0 => low,
        1 => high,
        2 => logarithmic(
            u,
            low.max(1e-9 * high.abs()).max(1e-300),
            high.abs().max(1e-9),
        ),
        3 => low + unit_fraction(u) * (high - low),
        4 => old + (high - old) * 1e-9 * unit_fraction(u),
        _ => old * (0.5 + unit_fraction(u)),
    };
    x.clamp(low, high)
}

/// A coordinate or a rate: usual values and arbitrary floating-point numbers.
pub fn any(u: &mut Unstructured, size: f64) -> f64 {
    match below(u, 8) {
        0 => 0.0,
        1 => u.arbitrary().unwrap_or(0.0),
        2 => {
            const EDGES: [f64; 8] = [5e-324, -5e-324, 1e-310, -0.0, 1e6, -1e6, 1e-12, 1e300];
            EDGES[below(u, EDGES.len())]
        }
        3 => 1e3 * size * (2.0 * unit_fraction(u) - 1.0),
        _ => size * (2.0 * unit_fraction(u) - 1.0),
    }
}

/// One value per coordinate up to `n`, from one byte each or a few of them from `any`.
pub fn vector(u: &mut Unstructured, start: &[f64; NV], n: usize, size: f64) -> [f64; NV] {
    let mut x = *start;
    if below(u, 3) == 0 {
        for x in &mut x[..n] {
            *x += size * f64::from(byte(u) as i8) / 128.0;
        }
    }
    for _ in 0..below(u, 4) {
        x[below(u, n)] = any(u, size);
    }
    x
}
