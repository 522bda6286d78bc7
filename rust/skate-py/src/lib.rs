//! Python bindings: conversion, and errors mapped once. No physics in here.

mod arrays;
mod scene;
mod simulator;

use pyo3::prelude::*;

/// The compiled engine; `skate_env/_core.pyi` documents it.
#[pymodule]
fn _core(m: &Bound<'_, PyModule>) -> PyResult<()> {
    m.add_class::<scene::Scene>()?;
    m.add_class::<simulator::Simulator>()
}
