//! Timing of operations that have no call of their own, or whose repetitions need the same state: they repeat inside
//! this module, so that only the operation is timed.

use crate::{
    error::{Invalid, Termination},
    lanes::{MAX_BATCH, advance_many},
    numeric::simd::Width,
    rhs::StepContext,
    sim::Simulation,
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
    /// One time step of the scene's scheme from the present state, including the events in it.
    Step,
    /// The same for a batch of copies.
    Batch,
}

impl Operation {
    const NAMED: [(&str, Self); 3] = [
        ("rhs", Self::RightHandSide),
        ("step", Self::Step),
        ("batch", Self::Batch),
    ];

    /// # Errors
    /// `Invalid` for an unknown name; the message lists the known ones.
    pub fn from_name(name: &str) -> Result<Self, Invalid> {
        let found = Self::NAMED.iter().find(|(known, _)| *known == name);
        found.map(|(_, operation)| *operation).ok_or_else(|| {
            let known = Self::NAMED.map(|(known, _)| known);
            Invalid(format!("work = \"{name}\": must be one of {known:?}"))
        })
    }

    /// Largest number of repetitions in one timed section.
    fn at_once(self) -> usize {
        match self {
            Self::RightHandSide => 256,
            Self::Step => 1,
            Self::Batch => MAX_BATCH,
        }
    }
}

/// Total time of `repeats` repetitions, each from the present state of `sim`. `sim` does not change. Copying the state
/// back costs as much as a step and is excluded; the clock's overhead, about 20 ns, is included. `go_on` is called
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
    let refused = |cause: Termination| {
        let cause = cause.name();
        Invalid(format!("no motion to time at this state: {cause}"))
    };
    sim.ended.map_or(Ok(()), Err).map_err(refused)?;
    let mut copies = vec![sim.clone()];
    let mut until = sim.state.t;
    if operation == Operation::Batch {
        copies[0].step_once().map_err(refused)?;
        until = copies[0].state.t;
        copies.resize(MAX_BATCH.min(repeats as usize), sim.clone());
    }
    let (mut left, mut spent) = (repeats as usize, Duration::ZERO);
    while left > 0 {
        if !go_on() {
            return Err(Invalid("the timing has been interrupted".into()));
        }
        let made = left.min(operation.at_once());
        copies.truncate(made);
        copies.iter_mut().for_each(|copy| copy.clone_from(sim));
        let started = Instant::now();
        match operation {
            Operation::RightHandSide => evaluate(sim, &mut copies[0], made),
            Operation::Step => black_box(&mut copies[0]).step_once(),
            Operation::Batch => {
                let batch = black_box(&mut copies).iter_mut().map(|copy| (copy, until));
                advance_many(batch, sim.model.scheme, (Width::widest(), MAX_BATCH), drop);
                Ok(())
            }
        }
        .map_err(refused)?;
        spent += started.elapsed();
        left -= made;
    }
    Ok(spent)
}

/// Evaluate the right-hand side at the state of `sim` in the workspace of `copy`.
fn evaluate(sim: &Simulation, copy: &mut Simulation, repeats: usize) -> Result<(), Termination> {
    let (model, state) = (&sim.model, &sim.state);
    let context = StepContext::of(model, state, &sim.residual);
    for _ in 0..repeats {
        let (q, v) = (black_box(&state.q), black_box(&state.v));
        copy.eval.accelerations(model, q, v, &context)?;
        black_box(&copy.eval.qdd);
    }
    Ok(())
}
