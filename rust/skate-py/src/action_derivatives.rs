//! Derivatives of a batch's actions as arrays.

use numpy::{
    IntoPyArray, PyArray1,
    ndarray::{Array2, Array3},
};
use pyo3::{prelude::*, types::PyDict};
use skate_core::task::ActionDerivatives;

/// Derivatives of all environments by name; zero for an environment without. Sizes of state, action and observation.
pub fn stacked<'py>(
    py: Python<'py>,
    all: &[Option<ActionDerivatives>],
    (state, joints, width): (usize, usize, usize),
) -> PyResult<Bound<'py, PyDict>> {
    type Entry = fn(&ActionDerivatives, usize, usize) -> f64;
    let value = |i: usize, at: (usize, usize), entry: Entry| {
        let by = all[i].as_ref();
        by.map_or(0.0, |by| entry(by, at.0, at.1))
    };
    let n = all.len();
    let dict = PyDict::new(py);
    let matrices: [(&str, (usize, usize), Entry); 3] = [
        ("A", (state, state), |by, r, c| by.A[(r, c)]),
        ("B", (state, joints), |by, r, c| by.B[(r, c)]),
        ("observation", (width, state), |by, r, c| {
            by.observation[(r, c)]
        }),
    ];
    for (name, (rows, columns), entry) in matrices {
        let shape = (n, rows, columns);
        let array = Array3::from_shape_fn(shape, |(i, r, c)| value(i, (r, c), entry));
        dict.set_item(name, array.into_pyarray(py))?;
    }
    let vectors: [(&str, usize, Entry); 2] = [
        ("reward_state", state, |by, r, _| by.reward[0][r]),
        ("reward_action", joints, |by, r, _| by.reward[1][r]),
    ];
    for (name, size, entry) in vectors {
        let array = Array2::from_shape_fn((n, size), |(i, r)| value(i, (r, 0), entry));
        dict.set_item(name, array.into_pyarray(py))?;
    }
    let exists = PyArray1::from_iter(py, all.iter().map(Option::is_some));
    dict.set_item("exists", exists)?;
    let mut nonsmooth = Vec::new();
    for (i, by) in all.iter().enumerate() {
        let found = by.iter().flat_map(|by| &by.nonsmooth);
        nonsmooth.extend(found.map(|x| (i, x.reason.name(), x.t, x.margin)));
    }
    dict.set_item("nonsmooth", nonsmooth)?;
    Ok(dict)
}
