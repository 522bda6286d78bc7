//! Arguments from Python, and errors to it. Whoever passes something else than is meant is told which
//! argument it was, what it is and what it must be.

use numpy::{IntoPyArray, PyArray1, PyArray2, PyArrayMethods, PyUntypedArrayMethods, ndarray};
use pyo3::{
    exceptions::{PyOverflowError, PyTypeError, PyValueError},
    prelude::*,
    types::{PyBool, PyBytes, PyDict, PyString},
};
use skate_core::{error::Invalid, model::NV, scene::Leg, state::check_finite};
use std::collections::BTreeMap;

/// What a person gives.
pub type Given<'a, 'py> = &'a Bound<'py, PyAny>;

/// Most characters of a wrong argument that a message repeats.
const SHOWN: usize = 60;

/// An error of the engine as Python's.
pub fn value_error(error: Invalid) -> PyErr {
    PyValueError::new_err(error.0)
}

/// An argument of the wrong type.
pub fn type_error(name: &str, given: Given<'_, '_>, wanted: &str) -> PyErr {
    let text = given
        .repr()
        .map_or_else(|_| "?".into(), |text| text.to_string());
    let shown: String = text.chars().take(SHOWN).collect();
    let dots = if shown.len() < text.len() { "..." } else { "" };
    let kind = given.get_type().name();
    let kind = kind.map_or_else(|_| "?".into(), |kind| kind.to_string());
    PyTypeError::new_err(format!(
        "{name} = {shown}{dots}: must be {wanted}, not {kind}"
    ))
}

/// A real number.
pub fn number(name: &str, given: Given<'_, '_>) -> PyResult<f64> {
    let py = given.py();
    if given.is_instance_of::<PyBool>() {
        return Err(type_error(name, given, "a real number"));
    }
    given.extract().map_err(|error: PyErr| {
        if error.is_instance_of::<PyOverflowError>(py) {
            PyValueError::new_err(format!("{name}: too large for a floating-point number"))
        } else {
            type_error(name, given, "a real number")
        }
    })
}

/// A seed.
pub fn seed(given: Given<'_, '_>) -> PyResult<u64> {
    let wanted = "an int from 0 to 2**64 - 1";
    if given.is_instance_of::<PyBool>() || !given.hasattr("__index__")? {
        return Err(type_error("seed", given, wanted));
    }
    given.extract().map_err(|_| {
        let text = given.to_string();
        PyValueError::new_err(format!("seed = {text}: must be {wanted}"))
    })
}

/// How often something is to be done.
pub fn repeats(given: Given<'_, '_>) -> PyResult<u32> {
    if given.is_instance_of::<PyBool>() || !given.hasattr("__index__")? {
        return Err(type_error("repeats", given, "an int"));
    }
    let count = given.extract().ok().filter(|&count| count >= 1);
    count.ok_or_else(|| {
        let text = given.to_string();
        PyValueError::new_err(format!("repeats = {text}: must be from 1 to {}", u32::MAX))
    })
}

/// A time at which the robot is looked at or put [s].
pub fn instant(given: Given<'_, '_>) -> PyResult<f64> {
    let t = number("t", given)?;
    Invalid::range("t", t, -1e6, 1e6, "s").map_err(value_error)?;
    Ok(t)
}

/// A word or a text.
pub fn text(name: &str, given: Given<'_, '_>) -> PyResult<String> {
    let text = given.cast::<PyString>();
    let text = text.map_err(|_| type_error(name, given, "a str"))?;
    let text = text.to_str().map_err(|error| {
        PyValueError::new_err(format!("{name}: cannot be written as UTF-8: {error}"))
    });
    Ok(text?.to_owned())
}

/// The bytes of a snapshot.
pub fn bytes<'a>(name: &str, given: Given<'a, '_>) -> PyResult<&'a [u8]> {
    let bytes = given.cast::<PyBytes>();
    let bytes = bytes.map_err(|_| type_error(name, given, "bytes"))?;
    Ok(bytes.as_bytes())
}

/// Numbers by their names.
pub fn numbers(name: &str, given: Given<'_, '_>) -> PyResult<BTreeMap<String, f64>> {
    let wanted = "a dict of numbers by name";
    let dict = given.cast::<PyDict>();
    let dict = dict.map_err(|_| type_error(name, given, wanted))?;
    let mut numbers = BTreeMap::new();
    for (key, value) in dict {
        let key = text(&format!("key of {name}"), &key)?;
        let value = number(&key, &value)?;
        numbers.insert(key, value);
    }
    Ok(numbers)
}

/// A matrix for Python.
pub type Out2<'py> = Bound<'py, PyArray2<f64>>;

/// A square one from its `n` rows.
pub fn square<'py>(py: Python<'py>, values: Vec<f64>, n: usize) -> PyResult<Out2<'py>> {
    let array = ndarray::Array2::from_shape_vec((n, n), values);
    Ok(array
        .map_err(|e| PyValueError::new_err(e.to_string()))?
        .into_pyarray(py))
}

/// One of the legs.
pub fn leg(given: Given<'_, '_>) -> PyResult<Leg> {
    match text("support_leg", given)?.as_str() {
        "right" => Ok(Leg::Right),
        "left" => Ok(Leg::Left),
        other => {
            let message = format!("support_leg = \"{other}\": must be \"right\" or \"left\"");
            Err(PyValueError::new_err(message))
        }
    }
}

/// An array of `n` rows of `m` finite numbers each, row after row; it must be one of f8 already.
pub fn block(name: &str, given: Given<'_, '_>, [n, m]: [usize; 2]) -> PyResult<Vec<f64>> {
    let wanted = format!("an array of float64 of shape ({n}, {m})");
    let array = given.cast::<PyArray2<f64>>();
    let array = array.map_err(|_| type_error(name, given, &wanted))?;
    if array.shape() != [n, m] {
        let shape = array.shape();
        let message = format!("{name} has shape {shape:?}: must be [{n}, {m}]");
        return Err(PyValueError::new_err(message));
    }
    let rows = array.try_readonly()?;
    let values: Vec<f64> = rows.as_array().iter().copied().collect();
    if let Some(bad) = values.iter().position(|x| !x.is_finite()) {
        let (i, j, x) = (bad / m, bad % m, values[bad]);
        let message = format!("{name}[{i}, {j}] = {x}: must be finite");
        return Err(PyValueError::new_err(message));
    }
    Ok(values)
}

/// A vector of `n` finite numbers, padded with zeros; anything that NumPy takes for one.
pub fn vector(name: &str, given: Given<'_, '_>, n: usize) -> PyResult<[f64; NV]> {
    // What most people pass needs no look at its type and shape by name.
    if let Ok(array) = given.cast::<PyArray1<f64>>()
        && array.is_contiguous()
        && array.data().is_aligned()
        && array.len() == n
    {
        return finite(name, array, n);
    }
    let numpy = given.py().import("numpy")?;
    let array = numpy.call_method1("asarray", (given,)).map_err(|error| {
        let why = error.value(given.py());
        PyValueError::new_err(format!("{name}: not an array of {n} numbers: {why}"))
    })?;
    let dtype = array.getattr("dtype")?;
    let kind: char = dtype.getattr("kind")?.extract()?;
    if !matches!(kind, 'f' | 'i' | 'u') {
        let message = format!("{name} has dtype {dtype}: must be {n} real numbers");
        return Err(PyTypeError::new_err(message));
    }
    let shape = array.getattr("shape")?;
    if shape.extract::<Vec<usize>>()? != [n] {
        let message = format!("{name} has shape {shape}: must be ({n},)");
        return Err(PyValueError::new_err(message));
    }
    let plain = numpy.call_method1("require", (array, "f8", "CA"))?;
    finite(name, plain.cast()?, n)
}

fn finite(name: &str, array: &Bound<'_, PyArray1<f64>>, n: usize) -> PyResult<[f64; NV]> {
    let array = array.readonly();
    let mut out = [0.0; NV];
    out[..n].copy_from_slice(array.as_slice()?);
    check_finite(name, &out[..n]).map_err(value_error)?;
    Ok(out)
}
