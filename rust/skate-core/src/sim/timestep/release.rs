//! Where a force vanishes in the course of a step that knows impulses only.

/// What a force comes to from the start of a step to a time in it, or before it.
#[derive(Debug, Clone, Copy)]
pub(super) struct Impulse {
    /// From the start; negative before it [s].
    t: f64,
    /// Mean force in between [N].
    mean: f64,
}

impl Impulse {
    pub fn of(mean: f64, t: f64) -> Self {
        Self { t, mean }
    }
}

/// The time before `h` at which a force becomes negative that is positive at the start. Its mean over [0, t]
/// is the polynomial through the two or three that are known, at different times.
pub(super) fn vanishing(known: &[Impulse], h: f64) -> Option<f64> {
    let [first, second, ..] = known else {
        return None;
    };
    // Newton's divided differences: mean = a + b t + c t^2.
    let slope = |x: &Impulse, y: &Impulse| (y.mean - x.mean) / (y.t - x.t);
    let b = slope(first, second);
    let c = known.get(2).map_or(0.0, |third| {
        (slope(second, third) - b) / (third.t - first.t)
    });
    let a = first.mean - first.t * (b - c * second.t);
    let b = b - c * (first.t + second.t);
    // The force is the slope of the impulse, t times its mean.
    let force = |t: f64| a + t * (2.0 * b + t * 3.0 * c);
    if !(force(0.0) > 0.0 && force(h) < 0.0) {
        return None;
    }
    // Of two roots the one that it goes down through: it alone is in between.
    let root = (b * b - 3.0 * a * c).sqrt();
    Some((a / (root - b)).min(h))
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Impulses of the force 3 c t^2 + 2 b t + a.
    fn of([a, b, c]: [f64; 3], t: f64) -> Impulse {
        Impulse::of(a + b * t + c * t * t, t)
    }

    #[test]
    fn a_line_and_a_parabola_vanish_where_they_do() {
        for (force, at) in [
            ([2.0, -1.0, 0.0], 1.0),
            // 3 (t - 1)(t - 3), and 3 (1 - t)(t + 2)
            ([9.0, -6.0, 1.0], 1.0),
            ([6.0, -1.5, -1.0], 1.0),
            // Steep towards the end.
            ([1.0, 0.0, -1.0 / 3.0], 1.0),
        ] {
            for times in [[-0.7, 0.9, 1.5], [0.4, 1.5, -2.0], [1.5, 0.75, 1.1]] {
                let known = times.map(|t| of(force, t));
                let found = vanishing(&known, 1.5);
                // 2e-16 measured.
                assert!((found.unwrap_or(0.0) - at).abs() < 1e-14, "{found:?}");
                if force[2] == 0.0 {
                    let found = vanishing(&known[..2], 1.5);
                    assert!((found.unwrap_or(0.0) - at).abs() < 1e-14, "{found:?}");
                }
            }
        }
    }

    #[test]
    fn a_force_that_goes_on_or_never_was_does_not_vanish() {
        for force in [
            [1.0, 0.5, 0.0],
            [1.0, -0.2, 0.0],
            [-1.0, 0.1, 0.0],
            [0.0; 3],
        ] {
            assert_eq!(vanishing(&[of(force, -1.0), of(force, 1.5)], 1.5), None);
        }
        assert_eq!(
            vanishing(&[of([f64::NAN; 3], -1.0), of([1.0; 3], 1.5)], 1.5),
            None
        );
        assert_eq!(vanishing(&[of([2.0, -1.0, 0.0], 1.5)], 1.5), None);
    }
}
