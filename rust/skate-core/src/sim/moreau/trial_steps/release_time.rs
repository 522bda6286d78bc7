//! Where a foot lets go in the course of a step that knows impulses only: where its load vanishes.

use crate::{
    contact::equations::Solution,
    error::Termination,
    events::guard::{Guard, load_value},
    model::contact_mode::End,
    sim::moreau::{
        Simulation,
        trial_steps::{AT_ONCE, CHANGES, Progress, Stepping, Trial},
    },
};

/// Located to this share of a step, with as many trials at most.
const RELEASED: f64 = 0.03;
const TRIALS: usize = 4;

impl Stepping {
    /// After a motion of the step's length: wish for a shorter one if a foot lets go in it, else finish.
    pub(super) fn release_or_finish(
        &mut self,
        sim: &mut Simulation,
        event: Option<Guard>,
    ) -> Result<Progress, Termination> {
        let push_only = sim.model.contact.is_unilateral();
        if push_only || self.changes > CHANGES {
            return self.finish(sim, event);
        }
        let h = self.h;
        for &guard in self.guards.as_slice() {
            let Guard::Load(foot, end) = guard else {
                continue;
            };
            let which = (foot, end);
            let whole = self.load(sim, which, &sim.eval.solution);
            let before = self.load_before(sim, which);
            let at = before.and_then(|before| vanishing(&[before, Impulse::of(whole, h)], h));
            if at.is_some() || whole < 0.0 {
                let at = at.unwrap_or(0.5 * h);
                return Ok(self.try_release(at, which, (whole, h), TRIALS));
            }
        }
        self.finish(sim, event)
    }

    /// After a trial for a release: another one, or the step ends where it has led. Only a foot that
    /// would be held down lets go; where it is about to, the next step sees whether it would.
    pub(super) fn release(
        &mut self,
        sim: &mut Simulation,
        which: (usize, End),
        (whole, h): (f64, f64),
        left: usize,
    ) -> Result<Progress, Termination> {
        let guard = Guard::Load(which.0, which.1);
        let mean = self.load(sim, which, &sim.eval.solution);
        let known = [Impulse::of(mean, self.h), Impulse::of(whole, h)];
        let before = self.load_before(sim, which);
        let by_three = before.and_then(|before| vanishing(&[before, known[0], known[1]], h));
        let at = by_three.or_else(|| vanishing(&known, h));
        let held = whole < 0.0;
        match at {
            _ if held && mean < 0.0 && at.is_none_or(|at| at <= AT_ONCE * h) => {
                self.release_at_once(sim, guard)
            }
            Some(at) if left > 1 && (at - self.h).abs() >= RELEASED * h => {
                Ok(self.try_release(at, which, (whole, h), left - 1))
            }
            _ => self.finish(sim, (held && at.is_some()).then_some(guard)),
        }
    }

    fn try_release(
        &mut self,
        at: f64,
        which: (usize, End),
        (whole, h): (f64, f64),
        left: usize,
    ) -> Progress {
        let trial = Trial::Release {
            which,
            whole,
            h,
            left,
        };
        self.wish(at, trial)
    }

    /// Mean load on an end that the start's mode has on the ice [N].
    fn load(&self, sim: &Simulation, which: (usize, End), forces: &Solution) -> f64 {
        load_value(&sim.model, self.wish.start.mode, forces, which)
    }

    /// That over the step before.
    fn load_before(&self, sim: &Simulation, which: (usize, End)) -> Option<Impulse> {
        let past = self.past?;
        Some(Impulse::of(self.load(sim, which, &past.forces), -past.h))
    }

    /// A foot lets go where the step begins.
    fn release_at_once(
        &mut self,
        sim: &mut Simulation,
        guard: Guard,
    ) -> Result<Progress, Termination> {
        let start = self.wish.start;
        sim.state = start;
        sim.happen(&start, |passage| passage.handle(guard))?;
        Ok(self.restart(sim))
    }
}

/// What a force comes to from the start of a step to a time in it, or before it.
#[derive(Debug, Clone, Copy)]
struct Impulse {
    /// From the start; negative before it [s].
    t: f64,
    /// Mean force in between [N].
    mean: f64,
}

impl Impulse {
    fn of(mean: f64, t: f64) -> Self {
        Self { t, mean }
    }
}

/// The time before `h` at which a force becomes negative that is positive at the start. Its mean over [0, t]
/// is the polynomial through the two or three that are known, at different times.
fn vanishing(known: &[Impulse], h: f64) -> Option<f64> {
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
