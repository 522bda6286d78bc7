//! Many simulations side by side in SIMD lanes.
//!
//! The equations are written once. `numeric::scalar::Scalar` is a number: an `f64`, or a register of 2, 4 or 8 of them
//! (`numeric::simd`). `model::lanes::ModelLanes` gives the numbers of one model, or of one model per lane. Every function
//! of a right-hand side or of a time step takes both, for example `rhs::Evaluation::evaluate` and
//! `time_stepping::step::moreau_step`. All operations work lane by lane without fused multiply-add, and a branch on
//! numbers is a choice by a mask. Therefore a simulation has the same bits in any lane and alone.
//!
//! ```text
//! one simulation      advance::Simulation::advance    steps of f64; the only path of a single environment
//! many simulations    advance_many
//!   which              scheduler       simulations with a step to compute, sorted by contact mode, in registers
//!   before and after   LaneDriver      the logic around a step, as for one simulation: `event_driver` for steps between
//!                                      located events, `time_steps` for steps with impulses
//!   the step           event_step, time_steps   gather the states, compute, scatter the results
//! ```
//!
//! What differs between lanes is handled alone, by the code for one simulation: events, rejected steps, implicit steps,
//! and steps of registers that are almost empty. Located events need one contact mode in a register; steps with impulses
//! solve the contact problem once for each mode in it. Functions that compute with registers are `#[inline(always)]`, so
//! that they are compiled within `Register::with_target_features`.

mod event_driver;
mod event_step;
mod scheduler;
mod time_steps;

use crate::{
    integrate::Method,
    model::scheme::{Methods, Scheme},
    numeric::simd::Width,
    sim::Simulation,
    time_stepping::StepDriver,
};
use event_driver::EventDriver;
pub(crate) use scheduler::MAX_BATCH;
use scheduler::{MAX_WAITING_BATCH, advance_in_lanes};
use std::ops::DerefMut;

/// Advance simulations of one scene, which may differ in their parameters, each to its own end time. The
/// results equal those of `Simulation::advance` on one after the other. The iterator is polled as lanes
/// become free, for at most `max_batch` simulations at once; `finished` receives the finished ones in arbitrary
/// order. `scheme` is the scene's.
pub fn advance_many<P: DerefMut<Target = Simulation>>(
    simulations: impl Iterator<Item = (P, f64)>,
    scheme: Scheme,
    (width, max_batch): (Width, usize),
    mut finished: impl FnMut(P),
) {
    let limits = (width, max_batch);
    match scheme {
        Scheme::TimeStepping { .. } => {
            advance_in_lanes::<StepDriver, _, MAX_BATCH>(simulations, limits, finished);
        }
        Scheme::EventDriven(Methods {
            usual: Method::Dop853(_),
            ..
        }) => {
            advance_in_lanes::<EventDriver, _, MAX_WAITING_BATCH>(simulations, limits, finished);
        }
        Scheme::EventDriven(_) => simulations.for_each(|(mut simulation, until)| {
            simulation.advance(until);
            finished(simulation);
        }),
    }
}
