//! Python bindings: conversion of arguments, results and errors. They contain no physics.

mod arrays;
mod batch;
mod infos;
mod scene;
mod signals;
mod simulator;
mod tables;

use numpy::PyArray1;
use pyo3::{prelude::*, types::PyDict};
use skate_core::scene::effects::EFFECTS;

/// Compiled engine; documented in `skate_env/_core.pyi`.
#[pymodule]
fn _core(m: &Bound<'_, PyModule>) -> PyResult<()> {
    // A fork while another thread loads NumPy's interface, or starts the thread pool, must not leave locks held.
    drop(PyArray1::<f64>::zeros(m.py(), 0, false));
    skate_core::batch::initialise_statics();
    let effects = PyDict::new(m.py());
    for effect in EFFECTS {
        effects.set_item(effect.name, effect.description)?;
    }
    m.add("EFFECTS", effects)?;
    m.add("TERMINATIONS", batch::termination_names())?;
    m.add_class::<scene::Scene>()?;
    m.add_class::<batch::Batch>()?;
    m.add_class::<simulator::Simulator>()
}
