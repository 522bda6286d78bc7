//! Numbers from bytes. Where bytes run out they are zero.

use arbitrary::Unstructured;
use skate_core::model::layout::NV;

/// One byte.
pub fn byte(u: &mut Unstructured) -> u8 {
    u.arbitrary().unwrap_or(0)
}

/// A number below `n`, at most 256.
pub fn below(u: &mut Unstructured, n: usize) -> usize {
    byte(u) as usize % n
}

/// From 0 to 1, in 65,536 steps.
fn share(u: &mut Unstructured) -> f64 {
    f64::from(u.arbitrary::<u16>().unwrap_or(0)) / f64::from(u16::MAX)
}

/// From `low` > 0 to `high`; small numbers are as likely as large ones.
pub fn logarithmic(u: &mut Unstructured, low: f64, high: f64) -> f64 {
    (low.ln() + share(u) * (high / low).ln())
        .exp()
        .clamp(low, high)
}

/// From `low` to `high`: one of the ends, the old value or near it, or anything.
pub fn within(u: &mut Unstructured, old: f64, low: f64, high: f64) -> f64 {
    let x = match below(u, 6) {
        0 => low,
        1 => high,
        2 => logarithmic(
            u,
            low.max(1e-9 * high.abs()).max(1e-300),
            high.abs().max(1e-9),
        ),
        3 => low + share(u) * (high - low),
        4 => old + (high - old) * 1e-9 * share(u),
        _ => old * (0.5 + share(u)),
    };
    x.clamp(low, high)
}

/// A coordinate, a rate: usual ones, and any number there is.
pub fn any(u: &mut Unstructured, size: f64) -> f64 {
    match below(u, 8) {
        0 => 0.0,
        1 => u.arbitrary().unwrap_or(0.0),
        2 => {
            const EDGES: [f64; 8] = [5e-324, -5e-324, 1e-310, -0.0, 1e6, -1e6, 1e-12, 1e300];
            EDGES[below(u, EDGES.len())]
        }
        3 => 1e3 * size * (2.0 * share(u) - 1.0),
        _ => size * (2.0 * share(u) - 1.0),
    }
}

/// One for each of the first `n` coordinates, a byte each, or a few of them with `any`.
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
