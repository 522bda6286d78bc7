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

/// Compiled engine; documented in `skate_env/_core.pyi`.
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
