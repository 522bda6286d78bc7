//! Time steps between events of many simulations in SIMD lanes. Simulations in the same contact mode share a register;
//! each has its own step length. Events are handled alone.

use crate::{
    control::ControllerInput,
    error::Termination,
    lanes::{
        event_step::{Workspace, step_lanes},
        scheduler::{Active, LaneDriver, LaneKey, active_in, in_lanes},
    },
    model::contact_mode::ContactMode,
    numeric::{
        scalar::{MAX_LANES, Mask},
        simd::Register,
    },
    sim::{
        Simulation,
        trial::{EndPoint, Trial},
    },
};
use std::ops::DerefMut;

/// Advances one simulation by steps between events.
#[derive(Debug)]
pub struct EventDriver {
    until: f64,
    /// The step to compute.
    trial: Option<Trial>,
}

impl EventDriver {
    /// Continue after the attempt of a step.
    fn process(
        &mut self,
        sim: &mut Simulation,
        outcome: Result<f64, Termination>,
        end: Option<&EndPoint<'_>>,
    ) {
        let Some(mut trial) = self.trial.take() else {
            return;
        };
        let next = match sim.judge(&mut trial, outcome) {
            Ok(Some(next_h)) => sim.accept(&trial, next_h, end),
            Ok(None) => Ok(Some(trial)),
            Err(cause) => sim.stop_at_singularity(cause).map(|()| None),
        };
        match next {
            Ok(trial) => self.trial = trial,
            Err(cause) => sim.ended = Some(cause),
        }
    }
}

impl LaneDriver for EventDriver {
    type Workspace<T: Register> = Workspace<T>;
    const MIXES_MODES: bool = false;

    fn new(sim: &mut Simulation, until: f64) -> Self {
        let mut driver = Self { until, trial: None };
        driver.start(sim, until);
        driver
    }

    fn start(&mut self, sim: &mut Simulation, until: f64) {
        (self.until, self.trial) = (until, None);
        if sim.ended.is_none() && sim.state.t < until {
            sim.budget.add_call();
        }
    }

    fn next_mode(&mut self, sim: &mut Simulation) -> Option<ContactMode> {
        while sim.ended.is_none() && sim.state.t < self.until {
            let (state, method, until) = (&sim.state, sim.method(), self.until);
            let new = || Trial::new(state, method, until);
            self.trial.get_or_insert_with(new).shorten(state.t);
            // Between a leg swap and the next sample, the controller numbers the joints from the other foot.
            let mirrored = ControllerInput::of(state).mirrored;
            if !(mirrored || method.is_implicit() || sim.observer.0.is_some()) {
                return Some(state.mode);
            }
            self.step_scalar(sim);
        }
        None
    }

    fn step_scalar(&mut self, sim: &mut Simulation) {
        if let Some(trial) = &self.trial {
            let outcome = sim.compute(trial);
            self.process(sim, outcome, None);
        }
    }

    fn finish(&mut self, sim: &mut Simulation) {
        let done = sim.complete_evaluation();
        sim.ended = sim.ended.or(done.err());
        sim.update_counters();
    }

    // Inlined, so that it is made in its place rather than copied.
    #[inline(always)]
    fn workspace<T: Register>(sim: &Simulation) -> Workspace<T> {
        Workspace::new(sim)
    }

    fn step_register<T: Register, P: DerefMut<Target = Simulation>>(
        workspace: &mut Workspace<T>,
        active: &mut [Option<Active<P, Self>>],
        keys: &[LaneKey],
    ) {
        let mut h = [0.0; MAX_LANES];
        for (lane, &key) in keys.iter().enumerate() {
            let Active { owner, driver } = active_in(active, key);
            h[lane] = driver.trial.map_or(0.0, |trial| trial.h);
            owner.start_in_lanes(h[lane]);
        }
        let first = h[0];
        h[keys.len()..].fill(first);
        let sims = std::array::from_fn(|i| &*in_lanes(active, keys, i).owner);
        let result = step_lanes(workspace, &sims, &h);
        for (lane, &key) in keys.iter().enumerate() {
            let Active { owner, driver } = active_in(active, key);
            let sim: &mut Simulation = owner;
            if result.failed.lane(lane) {
                driver.step_scalar(sim);
                continue;
            }
            let copy_slopes = |step: &mut _| workspace.copy_slopes(lane, step);
            let (error, end) = workspace.result(&result, (lane, &copy_slopes), sim);
            driver.process(sim, Ok(error), Some(&end));
        }
    }
}
