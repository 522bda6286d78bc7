//! Reward: slide in steps, with an upright head. `docs/iceskate-v0.md` says which exploit each term excludes.

use crate::{
    model::{Model, contact_mode::SoleContact, layout::NV},
    numeric::scalar::Scalar,
    rhs::Evaluation,
    sim::Simulation,
    task::{TERMS, Weights},
};
use serde::{Deserialize, Serialize};

/// What the reward reads before and after an action.
#[derive(Debug, Clone, Copy)]
pub struct Moment<T = f64> {
    /// [s]
    pub t: f64,
    /// Position of the hips, forward [m].
    pub hips: T,
    /// See `Totals`.
    pub loaded_slide: T,
    pub flight: T,
    pub swaps: u64,
}

impl Moment {
    pub fn of(sim: &Simulation) -> Self {
        let totals = sim.totals();
        Self {
            t: sim.state.t,
            hips: sim.state.q[0] + sim.sole_points.waist,
            loaded_slide: totals.loaded_slide,
            flight: totals.flight,
            swaps: totals.swaps,
        }
    }
}

/// Hips and slide where the present gait step began: after the action that completed the one before it.
#[derive(Debug, Clone, Copy, Default, PartialEq, Serialize, Deserialize)]
pub struct Progress<T = f64> {
    pub hips: T,
    pub slide: T,
}

impl<T: Scalar> Progress<T> {
    pub fn at(now: &Moment<T>) -> Self {
        Self {
            hips: now.hips,
            slide: now.loaded_slide,
        }
    }
}

/// Reward terms of an action between two moments, and the progress after it. `head` is the normalised height of the
/// head at its end (see `head_height`). `fallen`: the action has ended the episode by a termination.
pub fn terms<T: Scalar<Mask = bool>>(
    weights: &Weights,
    progress: Progress<T>,
    (before, now): (&Moment<T>, &Moment<T>),
    head: T,
    fallen: bool,
) -> ([T; TERMS.len()], Progress<T>) {
    let dt = now.t - before.t;
    let excess = (now.hips - before.hips).abs() - T::of(weights.high_speed * dt);
    // A slide that ends in a fall is not rewarded, nor are feet that slide forward under hips that do not. After an
    // overflow positions may have any size; the reward of a fall does without them.
    let (slide, after) = if now.swaps > before.swaps && !fallen {
        let (slid, way) = (now.loaded_slide - progress.slide, now.hips - progress.hips);
        (least(slid, way), Progress::at(now))
    } else {
        (T::zero(), progress)
    };
    let amounts = [
        slide,
        T::of(dt) * head,
        before.flight - now.flight,
        if fallen {
            T::zero()
        } else {
            least(T::zero(), -excess)
        },
        T::of(-f64::from(u8::from(fallen))),
    ];
    let mut terms = [T::zero(); TERMS.len()];
    for ((term, weight), amount) in terms.iter_mut().zip(weights.terms).zip(amounts) {
        // A terminated simulation may contain numbers that are not finite. The sum avoids -0.0.
        if amount.lane(0).is_finite() {
            *term = T::zero() + T::of(weight) * amount;
        }
    }
    (terms, after)
}

/// `f64::min`.
fn least<T: Scalar<Mask = bool>>(a: T, b: T) -> T {
    T::select(a.lt(b) || !b.le(b), a, b)
}

/// `f64::clamp`.
fn clamp<T: Scalar<Mask = bool>>(x: T, low: f64, high: f64) -> T {
    let (low, high) = (T::of(low), T::of(high));
    let at_least = T::select(x.lt(low), low, x);
    T::select(high.lt(at_least), high, at_least)
}

/// Height of the top of the head when standing upright [m].
pub fn standing_height(model: &Model) -> f64 {
    let zero = [0.0; NV];
    let mut eval = Evaluation::default();
    eval.set_configuration(model, SoleContact::Toe, &zero, &zero);
    eval.kin.head(model).z
}

/// Normalised head height: 1 at the height `standing`, 0 at the fall height (or at the ice, if the scene has no
/// fall condition).
pub fn head_height(sim: &Simulation, standing: f64) -> f64 {
    head_height_at(&sim.model, sim.head()[2], standing)
}

/// The same for a head at the height `head` [m].
pub fn head_height_at<T: Scalar<Mask = bool>>(model: &Model, head: T, standing: f64) -> T {
    let fallen = model.scene.fall.as_ref().map_or(0.0, |f| f.head_height);
    let span = standing - fallen;
    // If the fall height exceeds the standing height, the term is 0.
    if span > 0.0 {
        clamp((head - T::of(fallen)) / T::of(span), 0.0, 1.0)
    } else {
        T::zero()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Weights that differ, so that none stands for another.
    const WEIGHTS: Weights = Weights {
        terms: [3.0, 0.5, 7.0, 2.0, 11.0],
        high_speed: 5.0,
        longest_step: 2.0,
    };
    const BEFORE: Moment = Moment {
        t: 1.0,
        hips: 2.0,
        loaded_slide: 3.0,
        flight: 0.5,
        swaps: 4,
    };

    /// Terms of an action of 10 ms with an upright head, and the progress after it. It completes the gait step, in
    /// which the foot has slid by `slide` and the hips have moved by `way` within the action alone.
    fn paid_by(weights: &Weights, slide: f64, way: f64, flight: f64) -> [f64; TERMS.len()] {
        let now = Moment {
            t: BEFORE.t + 0.01,
            hips: BEFORE.hips + way,
            loaded_slide: BEFORE.loaded_slide + slide,
            flight: BEFORE.flight + flight,
            swaps: BEFORE.swaps + 1,
        };
        let (terms, after) = terms(weights, Progress::at(&BEFORE), (&BEFORE, &now), 1.0, false);
        assert_eq!(after, Progress::at(&now));
        terms
    }

    fn paid(slide: f64, way: f64, flight: f64) -> [f64; TERMS.len()] {
        paid_by(&WEIGHTS, slide, way, flight)
    }

    fn close(terms: [f64; TERMS.len()], expected: [f64; TERMS.len()]) {
        for (term, expected) in terms.iter().zip(expected) {
            assert!((term - expected).abs() < 1e-12, "{terms:?}");
        }
    }

    #[test]
    fn slide_and_an_upright_head_are_paid() {
        close(paid(0.02, 0.03, 0.0), [0.06, 0.005, 0.0, 0.0, 0.0]);
        close(paid(-0.02, -0.01, 0.0), [-0.06, 0.005, 0.0, 0.0, 0.0]);
    }

    #[test]
    fn feet_that_slide_under_hips_that_do_not_are_not_paid() {
        close(paid(0.02, -0.01, 0.0), [-0.03, 0.005, 0.0, 0.0, 0.0]);
    }

    /// What a step slides is paid once, where it is completed.
    #[test]
    fn a_slide_is_paid_with_its_step() {
        let (mut progress, mut before, mut sum) = (Progress::at(&BEFORE), BEFORE, 0.0);
        for action in 1_u32..=10 {
            let now = Moment {
                t: before.t + 0.01,
                hips: before.hips + 0.03,
                loaded_slide: before.loaded_slide + 0.02,
                swaps: before.swaps + u64::from(action % 4 == 0),
                ..before
            };
            let (terms, after) = terms(&WEIGHTS, progress, (&before, &now), 1.0, false);
            assert!((terms[0] > 0.0) == (action % 4 == 0), "{terms:?}");
            sum += terms[0];
            (progress, before) = (after, now);
        }
        // Eight of the ten actions belong to completed steps.
        assert!((sum - WEIGHTS.terms[0] * 0.16).abs() < 1e-12, "{sum}");
    }

    #[test]
    fn flight_costs_its_time_and_speed_the_way_beyond_the_high_one() {
        close(paid(0.0, 0.0, 0.004), [0.0, 0.005, -0.028, 0.0, 0.0]);
        for way in [0.08, -0.08] {
            close(
                paid(0.0, way, 0.0),
                [3.0 * way.min(0.0), 0.005, 0.0, -0.06, 0.0],
            );
        }
        // Up to the high speed the term is 0, without a sign.
        for way in [0.05 - 1e-12, 0.0, -0.05 + 1e-12] {
            assert_eq!(paid(0.0, way, 0.0)[3].to_bits(), 0.0_f64.to_bits());
        }
    }

    /// With the default weights.
    #[test]
    fn flight_and_high_speed_cost_more_than_they_gain() {
        let sum = |slide, way, flight| {
            let terms = paid_by(&Weights::default(), slide, way, flight);
            terms.iter().sum::<f64>()
        };
        // Half of the time in the air, the other half on the ice at the same speed.
        assert!(sum(0.02, 0.04, 0.005) < sum(0.04, 0.04, 0.0));
        let high = Weights::default().high_speed * 0.01;
        let sums = [1.0, 1.2, 2.0].map(|part| sum(part * high, part * high, 0.0));
        assert!(sums.is_sorted_by(|a, b| a > b), "{sums:?}");
    }

    #[test]
    fn a_fall_costs_more_than_an_upright_second() {
        let Weights { terms, .. } = Weights::default();
        assert!(terms[4] > 2.0 * terms[1]);
    }

    #[test]
    fn the_state_after_an_overflow_is_not_rewarded() {
        let now = Moment {
            t: 1.01,
            hips: 1e300,
            loaded_slide: -1e300,
            flight: f64::NAN,
            swaps: BEFORE.swaps + 1,
        };
        let weights = Weights::default();
        let (terms, _) = terms(&weights, Progress::at(&BEFORE), (&BEFORE, &now), 0.0, true);
        close(terms, [0.0, 0.0, 0.0, 0.0, -weights.terms[4]]);
    }
}
