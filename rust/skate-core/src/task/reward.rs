//! Reward: slide in steps with an upright head. `docs/iceskate-v0.md` says which exploit each term excludes.

use crate::{
    model::{Model, contact_mode::SoleContact, layout::NV},
    numeric::{scalar::Scalar, trig::wrap_angle},
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

/// The present gait step: time, hips and slide at its start, and the rewarded slide of the one before it.
#[derive(Debug, Clone, Copy, Default, PartialEq, Serialize, Deserialize)]
pub struct Progress<T = f64> {
    pub t: f64,
    pub hips: T,
    pub slide: T,
    pub last: T,
}

impl Progress {
    /// All numbers, in any units.
    pub fn numbers(&self) -> [f64; 4] {
        [self.t, self.hips, self.slide, self.last]
    }
}

impl<T: Scalar> Progress<T> {
    /// Start of an episode; its first step has none before it.
    pub fn new(now: &Moment<T>) -> Self {
        Self::at(now, T::zero())
    }

    fn at(now: &Moment<T>, last: T) -> Self {
        Self {
            t: now.t,
            hips: now.hips,
            slide: now.loaded_slide,
            last,
        }
    }
}

/// Values of the terms after an action, besides those of `Moment`.
#[derive(Debug, Clone, Copy)]
pub struct Posture<T = f64> {
    /// Normalised height of the head, see `head_height`.
    pub head: T,
    /// See `turned`.
    pub trunk: T,
    /// Mean square of the action.
    pub effort: T,
    /// The action has ended the episode by a termination.
    pub fallen: bool,
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

/// Reward terms of an action, and the progress after it.
pub fn terms<T: Scalar<Mask = bool>>(
    weights: &Weights,
    progress: Progress<T>,
    (before, now): (&Moment<T>, &Moment<T>),
    posture: &Posture<T>,
) -> ([T; TERMS.len()], Progress<T>) {
    let dt = now.t - before.t;
    let period = now.t - progress.t;
    // Gliding or standing without a step is not rewarded for longer.
    let rewarded = T::of(f64::from(u8::from(period <= weights.longest_step)));
    // Feet that slide forward under hips that do not are not rewarded, nor is excess speed.
    let within = |slide: T, hips: T, time: f64| {
        let most = weights.fastest * time;
        clamp(least(slide, hips), -most, most)
    };
    let slid = now.loaded_slide - before.loaded_slide;
    let slide = within(slid, now.hips - before.hips, dt);
    let stepped = now.swaps > before.swaps;
    let (mut step, mut after) = (T::zero(), progress);
    if stepped {
        let slid = now.loaded_slide - progress.slide;
        let distance = clamp(
            within(slid, now.hips - progress.hips, period),
            0.0,
            weights.long_slide,
        );
        // Full from the shortest period on, nothing at half of it: rattling feet are not rewarded.
        let long_enough = 2.0 * period / weights.shortest_step - 1.0;
        let distance = distance * T::of(long_enough.clamp(0.0, 1.0));
        // The shorter one of two steps: limping is not rewarded.
        step = least(distance, progress.last);
        after = Progress::at(now, distance);
    }
    let flight = now.flight - before.flight;
    let distance = (now.hips - before.hips).abs();
    let excess = clamp(
        distance - T::of(weights.high_speed * dt),
        0.0,
        f64::INFINITY,
    );
    // After an overflow angles and positions may have any size; the reward of a fall does without them.
    let [trunk, excess] = if posture.fallen {
        [T::zero(); 2]
    } else {
        [posture.trunk, excess]
    };
    let amounts = [
        rewarded * slide,
        rewarded * step,
        rewarded * T::of(dt) * posture.head,
        -flight,
        -excess,
        T::of(-dt) * trunk,
        T::of(-dt) * posture.effort,
        T::of(-f64::from(u8::from(posture.fallen))),
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

/// Squared yaw plus squared roll of the trunk, from `angles` [rad2]. Whole turns do not count: the robot faces forward
/// after them, and observations do not contain them.
pub fn turned<T: Scalar>(angles: impl Iterator<Item = T>) -> T {
    let wrapped = angles.map(wrap_angle);
    wrapped.fold(T::zero(), |sum, angle| sum + angle * angle)
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
    use std::f64::consts::{PI, TAU};

    /// A gait: period [s], slide, progress of the hips [m] and flight [s] of each step, in actions of 10 ms.
    fn paid(steps: &[(f64, f64, f64, f64)]) -> [f64; TERMS.len()] {
        paid_by(&Weights::default(), steps)
    }

    fn paid_by(weights: &Weights, steps: &[(f64, f64, f64, f64)]) -> [f64; TERMS.len()] {
        let mut now = Moment {
            t: 0.0,
            hips: 0.0,
            loaded_slide: 0.0,
            flight: 0.0,
            swaps: 0,
        };
        let mut progress = Progress::new(&now);
        let mut sums = [0.0; TERMS.len()];
        for &(period, slide, way, flight) in steps {
            let actions = (period / 0.01).round() as usize;
            for action in 1..=actions {
                let before = now;
                let share = 1.0 / actions as f64;
                now.t += period * share;
                now.hips += way * share;
                now.loaded_slide += slide * share;
                now.flight += flight * share;
                now.swaps += u64::from(action == actions);
                let posture = Posture {
                    head: 1.0,
                    trunk: 0.0,
                    effort: 0.0,
                    fallen: false,
                };
                let terms;
                (terms, progress) = super::terms(weights, progress, (&before, &now), &posture);
                sums.iter_mut()
                    .zip(terms)
                    .for_each(|(sum, term)| *sum += term);
            }
        }
        sums
    }

    fn total(steps: &[(f64, f64, f64, f64)]) -> f64 {
        paid(steps).iter().sum()
    }

    const GOOD: (f64, f64, f64, f64) = (0.5, 0.6, 0.6, 0.0);

    #[test]
    fn steps_are_paid_by_their_slide() {
        let [slide, step, head, ..] = paid(&[GOOD; 10]);
        assert!((slide - 4.0 * 6.0).abs() < 1e-9, "{slide}");
        // The first step has none before it.
        assert!((step - 10.0 * 5.4).abs() < 1e-9, "{step}");
        assert!((head - 2.0 * 5.0).abs() < 1e-9, "{head}");
    }

    #[test]
    fn speed_beyond_the_largest_is_not_paid() {
        let fast = [(0.5, 3.0, 3.0, 0.0); 10];
        let most = [(0.5, 0.75, 0.75, 0.0); 10];
        assert!((total(&fast) - total(&most)).abs() < 1e-9);
    }

    #[test]
    fn gliding_and_standing_are_paid_no_longer_than_a_step() {
        let longest = Weights::default().longest_step;
        let all = [(30.0, 30.0, 30.0, 0.0)];
        let first = [(longest, longest, longest, 0.0)];
        assert!(total(&all) <= total(&first) + 1e-9);
        assert_eq!(paid(&[(30.0, 0.0, 0.0, 0.0); 3])[1], 0.0);
    }

    #[test]
    fn the_shorter_one_of_two_steps_is_paid() {
        let limp = [GOOD, (0.5, 0.1, 0.1, 0.0)];
        let even = [(0.5, 0.1, 0.1, 0.0); 2];
        let [of_limp, of_even] = [limp, even].map(|two| paid(&two.repeat(5))[1]);
        assert!((of_limp - of_even).abs() < 1e-9);
        assert!(of_limp < 0.2 * paid(&[GOOD; 10])[1]);
    }

    #[test]
    fn short_steps_are_not_paid_as_steps() {
        assert_eq!(paid(&[(0.15, 0.3, 0.3, 0.0); 20])[1], 0.0);
    }

    #[test]
    fn feet_that_slide_under_hips_that_do_not_are_not_paid() {
        let [slide, step, ..] = paid(&[(0.5, 0.6, -0.2, 0.0); 10]);
        assert!(slide < 0.0 && step == 0.0, "{slide} {step}");
    }

    #[test]
    fn running_costs_more_than_it_gains() {
        // Half of the time in the air, the other half on the ice at the same speed.
        let run = (0.4, 0.2, 0.4, 0.2);
        assert!(total(&[run; 10]) < 0.5 * total(&[(0.4, 0.4, 0.4, 0.0); 10]));
    }

    #[test]
    fn displacement_beyond_the_high_speed_is_the_term_speed() {
        let step = |way| {
            paid_by(
                &Weights::with(&[("speed".into(), 2.0)].into()).expect("valid"),
                &[(0.5, 0.6, way, 0.0)],
            )
        };
        for way in [4.0, -4.0] {
            assert!((step(way)[4] + 2.0 * (4.0 - 0.5 * 2.5)).abs() < 1e-9);
        }
        assert_eq!(step(1.25 - 1e-9)[4], 0.0);
    }

    #[test]
    fn the_state_after_an_overflow_is_not_rewarded() {
        let before = Moment {
            t: 0.0,
            hips: 0.0,
            loaded_slide: 0.0,
            flight: 0.0,
            swaps: 0,
        };
        let now = Moment {
            t: 0.01,
            hips: 1e300,
            loaded_slide: -1e300,
            swaps: 1,
            ..before
        };
        let posture = Posture {
            head: 0.0,
            trunk: 1e75,
            effort: 1.0,
            fallen: true,
        };
        let weights = Weights::with(&[("speed".into(), 5.0)].into()).expect("valid");
        let (terms, _) = super::terms(&weights, Progress::new(&before), (&before, &now), &posture);
        let least = -weights.terms[7] - 0.1;
        assert!(terms.iter().sum::<f64>() > least, "{terms:?}");
    }

    #[test]
    fn whole_turns_of_the_trunk_do_not_count() {
        let (yaw, roll) = (0.4, -0.3);
        let near = |turns: f64| turned([yaw + turns * TAU, roll].into_iter());
        assert_eq!(near(0.0), yaw * yaw + roll * roll);
        for turns in [-2.0, 1.0, 3.0] {
            // Measured: 1.1e-15.
            assert!((near(turns) - near(0.0)).abs() < 1e-14);
        }
        // Largest where the robot faces backward, from either side.
        let side = |yaw: f64| turned([yaw].into_iter());
        assert!((side(PI - 1e-9) - side(PI + 1e-9)).abs() < 1e-13 && side(3.0) < side(PI));
    }

    #[test]
    fn a_fall_costs_more_than_an_upright_second() {
        let Weights { terms, .. } = Weights::default();
        assert!(terms[7] > 2.0 * terms[2]);
    }
}
