//! NumPy in and out.

use numpy::{AllowTypeChange, PyArrayLike1};
use pyo3::{exceptions::PyValueError, prelude::*};
use skate_core::{error::Invalid, model::NV, state::check_finite};

/// Anything that NumPy turns into a vector of floats.
pub type Input<'py> = PyArrayLike1<'py, f64, AllowTypeChange>;

/// An error of the engine as Python's.
pub fn value_error(error: Invalid) -> PyErr {
    PyValueError::new_err(error.0)
}

/// A vector of `n` finite numbers, padded with zeros.
pub fn vector(name: &str, input: &Input<'_>, n: usize) -> PyResult<[f64; NV]> {
    let view = input.as_array();
    if view.len() != n {
        let message = format!("{name} has shape ({},): must be ({n},)", view.len());
        return Err(PyValueError::new_err(message));
    }
    let mut out = [0.0; NV];
    out.iter_mut().zip(view).for_each(|(o, x)| *o = *x);
    check_finite(name, &out[..n]).map_err(value_error)?;
    Ok(out)
}
