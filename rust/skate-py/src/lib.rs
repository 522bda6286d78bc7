//! Python bindings: conversion of arguments, results and errors. They contain no physics.

#![deny(clippy::disallowed_methods)]

mod action_derivatives;
mod arrays;
mod batch;
mod derivatives;
mod infos;
mod scene;
mod signals;
mod simulator;
mod tables;

use numpy::{IntoPyArray, PyArrayMethods};
use pyo3::{prelude::*, types::PyDict};
use skate_core::scene::effects::EFFECTS;

/// Initialise now what is otherwise initialised on first use: NumPy's interfaces for arrays, for vectors as
/// arrays and for borrows, the keys of infos, the thread pool's statics. A fork while another thread
/// initialises one of them would leave it locked in the child.
fn initialise_statics(py: Python<'_>) -> PyResult<()> {
    let array = Vec::<f64>::new().into_pyarray(py);
    drop(array.try_readonly()?);
    drop(array.try_readwrite()?);
    infos::Keys::get(py);
    skate_core::batch::initialise_statics();
    Ok(())
}

/// The compiled engine. Angles in rad, lengths in m, forces in N, torques in N m, times in s.
///
/// Coordinates are those of the paper, rooted at the supporting foot: `y0, z0` the position of its toe
/// in every contact state, `q1` its rotation, `q2 .. q17` the joints; `n` is their number (19 when no
/// joint is locked). The notation page is part of the documentation of the Rust crate.
///
/// An argument of a wrong type raises TypeError. A wrong shape or value, or a number that is not
/// finite, raises ValueError. The message names the argument, its value and the valid values; nothing
/// has changed.
///
/// Long calls run the handlers of signals at least every 0.1 s, so that Ctrl-C raises
/// KeyboardInterrupt. `Simulator.advance` and `step` then leave the state at the end of a time step
/// before the end time, from which the simulation can continue; a reset leaves everything unchanged.
/// In `Batch.step` some environments have made their whole action, the others none. An action that has
/// begun is completed, which may take longer than 0.1 s in a costly scene with actions near 1 s.
#[pymodule]
fn _core(m: &Bound<'_, PyModule>) -> PyResult<()> {
    initialise_statics(m.py())?;
    let effects = PyDict::new(m.py());
    for effect in EFFECTS {
        effects.set_item(effect.name, effect.description)?;
    }
    m.add("EFFECTS", effects)?;
    m.add("TERMINATIONS", batch::termination_names())?;
    m.add("REWARD_WEIGHTS", batch::reward_weights())?;
    m.add_class::<scene::Scene>()?;
    m.add_class::<batch::Batch>()?;
    m.add_class::<derivatives::Linearization>()?;
    m.add_class::<simulator::Simulator>()
}
