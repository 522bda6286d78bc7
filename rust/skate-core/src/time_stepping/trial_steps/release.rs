//! Releases in two-way contact: an end of a sole leaves the ice when its load vanishes. A step gives mean loads only;
//! the load within the step is interpolated from the impulses of several steps.

use crate::{
    contact::equations::Solution,
    error::Termination,
    events::guard::{Guard, load_value},
    model::contact_mode::End,
    sim::Simulation,
    time_stepping::trial_steps::{MAX_RESTARTS, Progress, START_FRACTION, Trial, TrialSteps},
};

/// Tolerance of the time of a release, as a fraction of the step, and the maximum number of trial steps to locate it.
const RELEASE_TOLERANCE: f64 = 0.03;
const MAX_RELEASE_TRIALS: usize = 4;

impl TrialSteps {
    /// Complete a step, or request a shorter one if an end releases in it.
    pub(super) fn release_or_finish(
        &mut self,
        sim: &mut Simulation,
        event: Option<Guard>,
    ) -> Result<Progress, Termination> {
        let push_only = sim.model.contact.is_push_only;
        if push_only || self.attempts > MAX_RESTARTS {
            return self.finish(sim, event);
        }
        let h = self.h;
        for &guard in self.guards.as_slice() {
            let Guard::Load(foot, end) = guard else {
                continue;
            };
            let which = (foot, end);
            let full = MeanLoad::of(self.load(sim, which, &sim.eval.solution), h);
            let previous = self.previous_load(sim, which);
            let t = previous.and_then(|previous| zero_crossing(&[previous, full], h));
            if t.is_some() || full.mean < 0.0 {
                let t = t.unwrap_or(0.5 * h);
                return Ok(self.request_release(t, which, full, MAX_RELEASE_TRIALS));
            }
        }
        self.finish(sim, event)
    }

    /// Continue after a step to the estimated time of a release: request another one, or complete the step there. The
    /// foot releases only if the full step has a tensile mean load; a tensile load that begins late in the step is
    /// left to the next step.
    pub(super) fn process_release(
        &mut self,
        sim: &mut Simulation,
        which: (usize, End),
        full: MeanLoad,
        trials_left: usize,
    ) -> Result<Progress, Termination> {
        self.h = self.request.h;
        let guard = Guard::Load(which.0, which.1);
        let load = self.load(sim, which, &sim.eval.solution);
        let here = MeanLoad::of(load, self.h);
        let previous = self.previous_load(sim, which);
        let by_three = previous.and_then(|previous| zero_crossing(&[previous, here, full], full.t));
        let t = by_three.or_else(|| zero_crossing(&[here, full], full.t));
        let tensile = full.mean < 0.0;
        match t {
            _ if tensile && load < 0.0 && t.is_none_or(|t| t <= START_FRACTION * full.t) => {
                self.release_at_start(sim, guard)
            }
            Some(t) if trials_left > 1 && (t - self.h).abs() >= RELEASE_TOLERANCE * full.t => {
                Ok(self.request_release(t, which, full, trials_left - 1))
            }
            _ => self.finish(sim, (tensile && t.is_some()).then_some(guard)),
        }
    }

    fn request_release(
        &mut self,
        t: f64,
        which: (usize, End),
        full: MeanLoad,
        trials_left: usize,
    ) -> Progress {
        let trial = Trial::Release {
            which,
            full,
            trials_left,
        };
        self.request_trial(t, trial)
    }

    /// Mean load on an end that is on the ice in the start's mode [N].
    fn load(&self, sim: &Simulation, which: (usize, End), forces: &Solution) -> f64 {
        let start = &self.request.start;
        let forces = (start.levers(&sim.model), forces);
        load_value(&*sim.model, start.mode, forces, which)
    }

    /// Mean load over the previous step.
    fn previous_load(&self, sim: &Simulation, which: (usize, End)) -> Option<MeanLoad> {
        let previous = self.previous?;
        Some(MeanLoad::of(
            self.load(sim, which, &previous.forces),
            -previous.h,
        ))
    }

    /// Apply a release at the start of the step.
    fn release_at_start(
        &mut self,
        sim: &mut Simulation,
        guard: Guard,
    ) -> Result<Progress, Termination> {
        let start = self.request.start;
        sim.state = start;
        sim.apply_event(&start, |handler| handler.handle(guard))?;
        Ok(self.restart(sim))
    }
}

/// Mean load between the start of the step and the time `t` after it, negative for a time before it [s].
#[derive(Debug, Clone, Copy)]
pub(super) struct MeanLoad {
    t: f64,
    /// [N]
    mean: f64,
}

impl MeanLoad {
    fn of(mean: f64, t: f64) -> Self {
        Self { t, mean }
    }
}

/// Time before `h` at which a force that is positive at the start becomes negative. Its mean over [0, t] is the
/// polynomial through two or three known means at different times.
fn zero_crossing(known: &[MeanLoad], h: f64) -> Option<f64> {
    let [first, second, ..] = known else {
        return None;
    };
    // Newton's divided differences: mean = a + b t + c t^2.
    let slope = |x: &MeanLoad, y: &MeanLoad| (y.mean - x.mean) / (y.t - x.t);
    let b = slope(first, second);
    let c = known.get(2).map_or(0.0, |third| {
        (slope(second, third) - b) / (third.t - first.t)
    });
    let a = first.mean - first.t * (b - c * second.t);
    let b = b - c * (first.t + second.t);
    // The force is the derivative of the impulse, which is t times the mean.
    let force = |t: f64| a + t * (2.0 * b + t * 3.0 * c);
    if !(force(0.0) > 0.0 && force(h) < 0.0) {
        return None;
    }
    // Of the two roots, the one with a negative derivative lies in between.
    let root = (b * b - 3.0 * a * c).sqrt();
    Some((a / (root - b)).min(h))
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Mean load of the force 3 c t^2 + 2 b t + a.
    fn mean([a, b, c]: [f64; 3], t: f64) -> MeanLoad {
        MeanLoad::of(a + b * t + c * t * t, t)
    }

    #[test]
    fn zero_crossings_of_lines_and_parabolas_are_exact() {
        for (force, at) in [
            ([2.0, -1.0, 0.0], 1.0),
            // 3 (t - 1)(t - 3), and 3 (1 - t)(t + 2)
            ([9.0, -6.0, 1.0], 1.0),
            ([6.0, -1.5, -1.0], 1.0),
            // Steep towards the end.
            ([1.0, 0.0, -1.0 / 3.0], 1.0),
        ] {
            for times in [[-0.7, 0.9, 1.5], [0.4, 1.5, -2.0], [1.5, 0.75, 1.1]] {
                let known = times.map(|t| mean(force, t));
                let found = zero_crossing(&known, 1.5);
                // 2e-16 measured.
                assert!((found.unwrap_or(0.0) - at).abs() < 1e-14, "{found:?}");
                if force[2] == 0.0 {
                    let found = zero_crossing(&known[..2], 1.5);
                    assert!((found.unwrap_or(0.0) - at).abs() < 1e-14, "{found:?}");
                }
            }
        }
    }

    #[test]
    fn a_force_without_a_falling_zero_has_no_crossing() {
        for force in [
            [1.0, 0.5, 0.0],
            [1.0, -0.2, 0.0],
            [-1.0, 0.1, 0.0],
            [0.0; 3],
        ] {
            let known = [mean(force, -1.0), mean(force, 1.5)];
            assert_eq!(zero_crossing(&known, 1.5), None);
        }
        let known = [mean([f64::NAN; 3], -1.0), mean([1.0; 3], 1.5)];
        assert_eq!(zero_crossing(&known, 1.5), None);
        assert_eq!(zero_crossing(&[mean([2.0, -1.0, 0.0], 1.5)], 1.5), None);
    }
}
