//! Conversion of arguments from Python and of errors to Python. Every message names the argument, its value
//! and the valid values.

use numpy::{
    Element, IntoPyArray, PyArray2, PyArrayDyn, PyArrayMethods, PyUntypedArrayMethods, ndarray,
};
use pyo3::{
    exceptions::{PyException, PyOverflowError, PyTypeError, PyValueError},
    prelude::*,
    types::{PyBool, PyBytes, PyDict, PyFloat, PyList, PyString, PyTuple},
};
use skate_core::{
    error::Invalid,
    model::{layout::NV, state::check_finite},
    scene::Leg,
};
use std::collections::BTreeMap;

/// Argument of a Python call.
pub type Argument<'a, 'py> = &'a Bound<'py, PyAny>;

/// Maximum number of characters of a wrong argument in a message.
const MAX_SHOWN: usize = 60;

/// `Invalid` as a `ValueError`.
pub fn value_error(error: Invalid) -> PyErr {
    PyValueError::new_err(printable(&error.0))
}

/// Escape what controls a terminal or the direction of a text, all but line ends: parts of a message may be a
/// stranger's, as the keys of a scene file.
fn printable(text: &str) -> String {
    let mut escaped = String::with_capacity(text.len());
    for c in text.chars() {
        match c {
            '\n' | '"' | '\'' | '\\' => escaped.push(c),
            _ => escaped.extend(c.escape_debug()),
        }
    }
    escaped
}

/// `other` for an error of an argument's own code, except that Ctrl-C and exits pass.
fn instead(py: Python<'_>, error: PyErr, other: impl FnOnce(PyErr) -> PyErr) -> PyErr {
    if error.is_instance_of::<PyException>(py) {
        other(error)
    } else {
        error
    }
}

/// Beginning of an argument's text for a message.
fn shown(given: Argument<'_, '_>) -> PyResult<String> {
    let text = match given.repr() {
        Ok(text) => text.to_string(),
        // An int of more than 4300 digits has no text.
        Err(error) if error.is_instance_of::<PyException>(given.py()) => "?".into(),
        Err(error) => return Err(error),
    };
    let shown: String = text.chars().take(MAX_SHOWN).collect();
    let dots = if shown.len() < text.len() { "..." } else { "" };
    Ok(format!("{shown}{dots}"))
}

/// `TypeError` for an argument of the wrong type.
pub fn type_error(name: &str, given: Argument<'_, '_>, wanted: &str) -> PyErr {
    let shown = match shown(given) {
        Ok(shown) => shown,
        Err(error) => return error,
    };
    let kind = given.get_type().name();
    let kind = kind.map_or_else(|_| "?".into(), |kind| kind.to_string());
    PyTypeError::new_err(format!("{name} = {shown}: must be {wanted}, not {kind}"))
}

/// A real number.
pub fn number(name: &str, given: Argument<'_, '_>) -> PyResult<f64> {
    let py = given.py();
    if given.is_instance_of::<PyBool>() {
        return Err(type_error(name, given, "a real number"));
    }
    given.extract().map_err(|error| {
        instead(py, error, |error| {
            if error.is_instance_of::<PyOverflowError>(py) {
                PyValueError::new_err(format!("{name}: too large for a floating-point number"))
            } else {
                type_error(name, given, "a real number")
            }
        })
    })
}

/// An integer of any size from `low` to `high`.
pub fn integer(name: &str, given: Argument<'_, '_>, low: u64, high: u64) -> PyResult<u64> {
    let most = match high {
        u64::MAX => "2**64 - 1".into(),
        high => high.to_string(),
    };
    let wanted = format!("an int from {low} to {most}");
    if given.is_instance_of::<PyBool>() || !given.hasattr("__index__")? {
        return Err(type_error(name, given, &wanted));
    }
    let out_of_range = || match shown(given) {
        Ok(text) => PyValueError::new_err(format!("{name} = {text}: must be {wanted}")),
        Err(error) => error,
    };
    let found: PyResult<u64> = given.extract();
    let found = found.map_err(|error| instead(given.py(), error, |_| out_of_range()))?;
    if !(low..=high).contains(&found) {
        return Err(out_of_range());
    }
    Ok(found)
}

/// A time at which the dynamics are evaluated or the state is set [s].
pub fn instant(given: Argument<'_, '_>) -> PyResult<f64> {
    let t = number("t", given)?;
    Invalid::range("t", t, -1e6, 1e6, "s").map_err(value_error)?;
    Ok(t)
}

/// A string.
pub fn text(name: &str, given: Argument<'_, '_>) -> PyResult<String> {
    let text = given.cast::<PyString>();
    let text = text.map_err(|_| type_error(name, given, "a str"))?;
    let text = text.to_str().map_err(|error| {
        PyValueError::new_err(format!("{name}: cannot be written as UTF-8: {error}"))
    });
    Ok(text?.to_owned())
}

/// A list of strings.
pub fn names(name: &str, given: Argument<'_, '_>) -> PyResult<Vec<String>> {
    let list = given.cast::<PyList>();
    let list = list.map_err(|_| type_error(name, given, "a list of str"))?;
    list.iter().map(|item| text(name, &item)).collect()
}

/// The bytes of a snapshot.
pub fn bytes<'a>(name: &str, given: Argument<'a, '_>) -> PyResult<&'a [u8]> {
    let bytes = given.cast::<PyBytes>();
    let bytes = bytes.map_err(|_| type_error(name, given, "bytes"))?;
    Ok(bytes.as_bytes())
}

/// A dict from names to numbers.
pub fn numbers(name: &str, given: Argument<'_, '_>) -> PyResult<BTreeMap<String, f64>> {
    let wanted = "a dict of numbers by name";
    let dict = given.cast::<PyDict>();
    let dict = dict.map_err(|_| type_error(name, given, wanted))?;
    let mut numbers = BTreeMap::new();
    // A copy of the items: the code of a value may change the dict.
    for item in dict.items() {
        let (key, value): (Bound<'_, PyAny>, Bound<'_, PyAny>) = item.extract()?;
        let key = text(&format!("key of {name}"), &key)?;
        let value = number(&key, &value)?;
        numbers.insert(key, value);
    }
    Ok(numbers)
}

/// Matrix returned to Python.
pub type Out2<'py> = Bound<'py, PyArray2<f64>>;

/// Square matrix from its `n` rows.
pub fn square<'py>(py: Python<'py>, values: Vec<f64>, n: usize) -> PyResult<Out2<'py>> {
    let array = ndarray::Array2::from_shape_vec((n, n), values);
    Ok(array
        .map_err(|e| PyValueError::new_err(e.to_string()))?
        .into_pyarray(py))
}

/// A leg.
pub fn leg(given: Argument<'_, '_>) -> PyResult<Leg> {
    match text("support_leg", given)?.as_str() {
        "right" => Ok(Leg::Right),
        "left" => Ok(Leg::Left),
        other => {
            let message = format!("support_leg = \"{other}\": must be \"right\" or \"left\"");
            Err(PyValueError::new_err(message))
        }
    }
}

/// Finite real numbers of the given shape, in row-major order, from anything that NumPy converts.
pub fn reals(name: &str, given: Argument<'_, '_>, shape: &[usize]) -> PyResult<Vec<f64>> {
    // Fast path for the most common types.
    if let Ok(array) = given.cast::<PyArrayDyn<f32>>()
        && is_plain(array, shape)
    {
        return finite_reals(name, array);
    }
    if let Ok(array) = given.cast::<PyArrayDyn<f64>>()
        && is_plain(array, shape)
    {
        return finite_reals(name, array);
    }
    finite_reals::<f64>(name, required(name, given, shape)?.cast()?)
}

fn finite_reals<T: Element + Copy + Into<f64>>(
    name: &str,
    array: &Bound<'_, PyArrayDyn<T>>,
) -> PyResult<Vec<f64>> {
    let view = array.try_readonly()?;
    let values: Vec<f64> = view.as_slice()?.iter().map(|&x| x.into()).collect();
    // No early exit, so that the loop is vectorised.
    if values.iter().fold(true, |so_far, x| so_far & x.is_finite()) {
        return Ok(values);
    }
    let at = values.iter().position(|x| !x.is_finite()).unwrap_or(0);
    let mut rest = at;
    let mut index = vec![0; array.ndim()];
    for (index, &length) in index.iter_mut().zip(array.shape()).rev() {
        (*index, rest) = (rest % length, rest / length);
    }
    let bad = PyFloat::new(array.py(), values[at]);
    let message = format!("{name}{index:?} = {bad}: must be finite");
    Err(PyValueError::new_err(message))
}

/// Vector of `n` finite numbers, padded with zeros, from anything that NumPy converts.
pub fn vector(name: &str, given: Argument<'_, '_>, n: usize) -> PyResult<[f64; NV]> {
    if let Ok(array) = given.cast::<PyArrayDyn<f64>>()
        && is_plain(array, &[n])
    {
        return finite(name, array, n);
    }
    finite(name, required(name, given, &[n])?.cast()?, n)
}

/// Whether an array has the shape and can be read without conversion.
fn is_plain<T: Element>(array: &Bound<'_, PyArrayDyn<T>>, shape: &[usize]) -> bool {
    array.shape() == shape && array.is_c_contiguous() && array.data().is_aligned()
}

/// NumPy's conversion of an argument to real numbers (f8) of the given shape.
fn required<'py>(
    name: &str,
    given: Argument<'_, 'py>,
    shape: &[usize],
) -> PyResult<Bound<'py, PyAny>> {
    let count: Vec<String> = shape.iter().map(ToString::to_string).collect();
    let count = count.join(" x ");
    let numpy = given.py().import("numpy")?;
    let array = numpy.call_method1("asarray", (given,)).map_err(|error| {
        instead(given.py(), error, |error| {
            let why = error.value(given.py());
            PyValueError::new_err(format!("{name}: not an array of {count} numbers: {why}"))
        })
    })?;
    let dtype = array.getattr("dtype")?;
    let kind: char = dtype.getattr("kind")?.extract()?;
    if !matches!(kind, 'f' | 'i' | 'u') {
        let message = format!("{name} has dtype {dtype}: must be {count} real numbers");
        return Err(PyTypeError::new_err(message));
    }
    let wanted = PyTuple::new(given.py(), shape)?;
    let found = array.getattr("shape")?;
    if !found.eq(&wanted)? {
        let message = format!("{name} has shape {found}: must be {wanted}");
        return Err(PyValueError::new_err(message));
    }
    let converted = numpy.call_method1("require", (array, "f8", "CA"));
    // Where warnings are errors, an overflow is one.
    converted.map_err(|error| {
        instead(given.py(), error, |error| {
            let why = error.value(given.py());
            PyValueError::new_err(format!("{name}: must be finite: {why}"))
        })
    })
}

fn finite(name: &str, array: &Bound<'_, PyArrayDyn<f64>>, n: usize) -> PyResult<[f64; NV]> {
    let array = array.try_readonly()?;
    let mut out = [0.0; NV];
    out[..n].copy_from_slice(array.as_slice()?);
    check_finite(name, &out[..n]).map_err(value_error)?;
    Ok(out)
}
