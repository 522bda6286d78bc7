//! Timing of single operations. The repetitions run inside this module, so that only the operation is
//! timed.

use crate::{
    advance::advance_many,
    error::{Invalid, Termination},
    numeric::simd::Width,
    rhs::StepContext,
    sim::{MAX_BATCH, Simulation},
};
use std::{
    hint::black_box,
    time::{Duration, Instant},
};

/// Operations that can be timed.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Operation {
    /// Right-hand side in the present contact mode: M, bias forces, torques, factorisation, contact forces.
    RightHandSide,
    /// One time step of the scene's method from the present state, including the events in it.
    Step,
    /// The same for a batch of copies.
    Batch,
    /// Reset to the scene's start.
    Reset,
    Snapshot,
    /// Restore a snapshot of the present state.
    Restore,
}

impl Operation {
    pub const ALL: [Self; 6] = [
        Self::RightHandSide,
        Self::Step,
        Self::Batch,
        Self::Reset,
        Self::Snapshot,
        Self::Restore,
    ];

    pub fn name(self) -> &'static str {
        match self {
            Self::RightHandSide => "rhs",
            Self::Step => "step",
            Self::Batch => "batch",
            Self::Reset => "reset",
            Self::Snapshot => "snapshot",
            Self::Restore => "restore",
        }
    }

    /// # Errors
    /// `Invalid` for an unknown name; the message lists the known ones.
    pub fn from_name(name: &str) -> Result<Self, Invalid> {
        let found = Self::ALL
            .into_iter()
            .find(|operation| operation.name() == name);
        found.ok_or_else(|| {
            let known = Self::ALL.map(Self::name);
            Invalid(format!("work = \"{name}\": must be one of {known:?}"))
        })
    }
}

/// Maximum number of repetitions between two calls of `go_on`: up to 20 ms of the slowest operation.
const BLOCK: u32 = 256;

/// Total time of `repeats` repetitions, each from the present state of `sim`. `sim` does not change. `go_on` is called
/// outside of the timed sections and returns false to interrupt.
///
/// # Errors
/// `Invalid` if the simulation has terminated or terminates during the operation, or the timing is interrupted.
pub fn time(
    sim: &Simulation,
    operation: Operation,
    repeats: u32,
    go_on: &dyn Fn() -> bool,
) -> Result<Duration, Invalid> {
    let moves = matches!(
        operation,
        Operation::RightHandSide | Operation::Step | Operation::Batch
    );
    if let Some(cause) = sim.ended.filter(|_| moves) {
        return Err(cannot_time(operation, cause));
    }
    let mut timer = Timer::new(sim);
    let (mut left, mut spent) = (repeats, Duration::ZERO);
    while left > 0 {
        if !go_on() {
            return Err(Invalid("the timing has been interrupted".into()));
        }
        let block = left.min(BLOCK);
        spent += timer.time(operation, block)?;
        left -= block;
    }
    Ok(spent)
}

/// Copies of a simulation on which operations are timed.
struct Timer<'a> {
    sim: &'a Simulation,
    copy: Simulation,
    batch: Vec<Simulation>,
    snapshot: Vec<u8>,
}

impl<'a> Timer<'a> {
    fn new(sim: &'a Simulation) -> Self {
        Self {
            sim,
            copy: sim.clone(),
            batch: Vec::new(),
            snapshot: sim.snapshot(),
        }
    }

    /// Total time of `repeats` repetitions.
    fn time(&mut self, operation: Operation, repeats: u32) -> Result<Duration, Invalid> {
        let (sim, copy) = (self.sim, &mut self.copy);
        match operation {
            Operation::RightHandSide => {
                let (model, state) = (&sim.model, &sim.state);
                let context = StepContext::of(model, state, &sim.residual);
                let started = Instant::now();
                for _ in 0..repeats {
                    let (q, v) = (black_box(&state.q), black_box(&state.v));
                    copy.eval
                        .accelerations(model, q, v, &context)
                        .map_err(|cause| cannot_time(operation, cause))?;
                    black_box(&copy.eval.qdd);
                }
                Ok(started.elapsed())
            }
            // Copying the state back costs as much as a step and is excluded. The clock's overhead, about 20 ns
            // per step, is included.
            Operation::Step => (0..repeats).try_fold(Duration::ZERO, |spent, _| {
                copy.clone_from(sim);
                let started = Instant::now();
                let done = black_box(&mut *copy).step_once();
                let spent = spent + started.elapsed();
                done.map(|()| spent)
                    .map_err(|cause| cannot_time(operation, cause))
            }),
            Operation::Batch => {
                copy.step_once()
                    .map_err(|cause| cannot_time(operation, cause))?;
                let until = copy.state.t;
                let limits = (Width::widest(), MAX_BATCH);
                let batch = &mut self.batch;
                batch.resize(MAX_BATCH.min(repeats as usize), copy.clone());
                let (mut left, mut spent) = (repeats as usize, Duration::ZERO);
                while left > 0 {
                    batch.truncate(left);
                    for copy in &mut *batch {
                        copy.clone_from(sim);
                    }
                    let started = Instant::now();
                    let sims = black_box(&mut *batch).iter_mut().map(|copy| (copy, until));
                    advance_many(sims, sim.model.scheme, limits, drop);
                    spent += started.elapsed();
                    left -= batch.len();
                }
                Ok(spent)
            }
            Operation::Reset => {
                let (model, start) = (&sim.model, &sim.model.scene.start);
                let (q, v) = (model.from_names(&start.q), model.from_names(&start.v));
                let started = Instant::now();
                for _ in 0..repeats {
                    copy.reset(black_box(&q), &v, start.support_leg)?;
                }
                Ok(started.elapsed())
            }
            Operation::Snapshot => {
                let started = Instant::now();
                for _ in 0..repeats {
                    black_box(black_box(sim).snapshot());
                }
                Ok(started.elapsed())
            }
            Operation::Restore => {
                let started = Instant::now();
                for _ in 0..repeats {
                    copy.restore(black_box(&self.snapshot))?;
                }
                Ok(started.elapsed())
            }
        }
    }
}

fn cannot_time(operation: Operation, cause: Termination) -> Invalid {
    Invalid(format!(
        "{} cannot be timed at this state: {}",
        operation.name(),
        cause.name()
    ))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::{
        model::Model,
        scene::{Accuracy, AccuracyName, Scene},
    };

    fn sim(accuracy: AccuracyName) -> Simulation {
        let text = include_str!("../../../skate_env/scenes/paper_printed.toml");
        let mut scene = Scene::from_toml(text).expect("a valid scene");
        scene.accuracy = Accuracy::Named(accuracy);
        Simulation::new(Model::compile(&scene).expect("a model")).expect("a start")
    }

    #[test]
    fn timing_does_not_change_the_simulation() {
        for accuracy in [AccuracyName::Fast, AccuracyName::Balanced] {
            let sim = sim(accuracy);
            let before = sim.snapshot();
            for operation in Operation::ALL {
                assert!(
                    time(&sim, operation, 3, &|| true).is_ok(),
                    "{}",
                    operation.name()
                );
                assert_eq!(sim.snapshot(), before, "{}", operation.name());
            }
        }
    }

    #[test]
    fn time_steps_add_up_to_an_action_period() {
        let mut whole = sim(AccuracyName::Fast);
        // No event occurs between 0.05 s and 0.12 s, so no step is divided.
        whole.advance(0.05);
        let mut parts = whole.clone();
        while parts.state.t < 0.12 - 1e-9 {
            parts.step_once().expect("a motion");
        }
        while whole.state.t < parts.state.t - 1e-9 {
            let until = whole.next_action_time();
            whole.advance(until);
        }
        assert!((whole.state.t - parts.state.t).abs() < 1e-12);
        // The steps differ by rounding only: 1.1e-15.
        let pairs = whole.state.q.iter().zip(&parts.state.q);
        let worst = pairs.map(|(a, b)| (a - b).abs()).fold(0.0, f64::max);
        assert!(worst < 1e-12, "{worst:e}");
    }

    #[test]
    fn a_terminated_simulation_cannot_be_timed() {
        let mut sim = sim(AccuracyName::Fast);
        sim.ended = Some(Termination::Fall);
        for operation in [Operation::RightHandSide, Operation::Step, Operation::Batch] {
            let refused = time(&sim, operation, 1, &|| true).expect_err("an end").0;
            assert!(
                refused.contains(operation.name()) && refused.contains("fall"),
                "{refused}"
            );
        }
        assert!(time(&sim, Operation::Reset, 1, &|| true).is_ok());
    }

    #[test]
    fn operations_are_found_by_name() {
        for operation in Operation::ALL {
            assert_eq!(Operation::from_name(operation.name()), Ok(operation));
        }
        let refused = Operation::from_name("sleep").expect_err("unknown").0;
        assert!(
            refused.contains("sleep") && refused.contains("rhs"),
            "{refused}"
        );
    }
}
