//! Infos as people read them: a dict of one environment, or arrays over many as Gymnasium has them.

use numpy::{IntoPyArray, PyArray1};
use pyo3::{
    prelude::*,
    types::{PyDict, PyString},
};
use skate_core::{
    batch::{Last, Outcome},
    error::EndCause,
    scene::Leg,
    task::{Info, TERMS},
};

const LEGS: [Option<&str>; 2] = [Some(Leg::Right.name()), Some(Leg::Left.name())];
const ENDS: [Option<&str>; 6] = [
    None,
    Some(EndCause::Fall.name()),
    Some(EndCause::Jam.name()),
    Some(EndCause::Singular.name()),
    Some(EndCause::StepLimit.name()),
    Some(EndCause::NotFinite.name()),
];

/// Tell what infos hold, key by key.
fn tell(to: &mut impl Listener) -> PyResult<()> {
    to.number("time", |info| info.time)?;
    to.count("state_number", |info| info.state_number.into())?;
    to.name("support_leg", &LEGS, |info| info.leg as usize)?;
    to.count("steps", |info| info.steps as i64)?;
    to.number("flight_time", |info| info.flight_time)?;
    to.number("double_support_time", |info| info.double_support_time)?;
    to.number("y_position", |info| info.y_position)?;
    to.name("end_cause", &ENDS, |info| {
        info.end.map_or(0, |end| 1 + end as usize)
    })?;
    for (i, term) in TERMS.iter().enumerate() {
        to.number(&format!("reward_{term}"), |info| info.terms[i])?;
    }
    Ok(())
}

trait Listener {
    fn number(&mut self, key: &str, of: impl Fn(&Info) -> f64) -> PyResult<()>;
    fn count(&mut self, key: &str, of: impl Fn(&Info) -> i64) -> PyResult<()>;
    /// One of some names, by its index.
    fn name(
        &mut self,
        key: &str,
        names: &[Option<&str>],
        of: impl Fn(&Info) -> usize,
    ) -> PyResult<()>;
}

/// Plain values of one environment.
pub fn single<'py>(py: Python<'py>, info: &Info) -> PyResult<Bound<'py, PyDict>> {
    let dict = PyDict::new(py);
    tell(&mut Single { dict: &dict, info })?;
    Ok(dict)
}

struct Single<'py, 'a> {
    dict: &'a Bound<'py, PyDict>,
    info: &'a Info,
}

impl<'py> Single<'py, '_> {
    fn set(&self, key: &str, value: impl IntoPyObject<'py>) -> PyResult<()> {
        let key = PyString::intern(self.dict.py(), key);
        self.dict.set_item(key, value)
    }
}

impl Listener for Single<'_, '_> {
    fn number(&mut self, key: &str, of: impl Fn(&Info) -> f64) -> PyResult<()> {
        self.set(key, of(self.info))
    }

    fn count(&mut self, key: &str, of: impl Fn(&Info) -> i64) -> PyResult<()> {
        self.set(key, of(self.info))
    }

    fn name(
        &mut self,
        key: &str,
        names: &[Option<&str>],
        of: impl Fn(&Info) -> usize,
    ) -> PyResult<()> {
        self.set(key, known(self.dict.py(), names[of(self.info)]))
    }
}

/// Who ended in a step that has also reset them, and with what.
pub fn ended(outcomes: &[Outcome]) -> impl Iterator<Item = (usize, &Last)> {
    let all = outcomes.iter().enumerate();
    all.filter_map(|(i, (_, last))| Some((i, last.as_deref()?)))
}

/// Of all environments after a step, and of what those ended with that it has reset.
pub fn of_step<'py>(py: Python<'py>, outcomes: &[Outcome]) -> PyResult<Bound<'py, PyDict>> {
    let n = outcomes.len();
    let dict = many(py, n, None, |i| &outcomes[i].0.info)?;
    let mut which = Vec::new();
    let mut observations: Vec<Py<PyAny>> = Vec::new();
    for (i, last) in ended(outcomes) {
        which.push(i);
        observations.resize_with(i, || py.None());
        let observation = PyArray1::from_slice(py, &last.observation);
        observations.push(observation.into_any().unbind());
    }
    if which.is_empty() {
        return Ok(dict);
    }
    observations.resize_with(n, || py.None());
    let infos = many(py, n, Some(&which), |i| {
        let (row, last) = &outcomes[i];
        last.as_deref().map_or(&row.info, |last| &last.row.info)
    })?;
    let mask = || PyArray1::from_iter(py, outcomes.iter().map(|(_, last)| last.is_some()));
    dict.set_item("final_obs", observations.into_pyarray(py))?;
    dict.set_item("_final_obs", mask())?;
    dict.set_item("final_info", infos)?;
    dict.set_item("_final_info", mask())?;
    Ok(dict)
}

/// Of all of `n` environments: an array a key, and a mask `_key` of those that have one. Or of some of them, with
/// zeros and None for the others.
pub fn many<'py, 'a>(
    py: Python<'py>,
    n: usize,
    which: Option<&[usize]>,
    of: impl Fn(usize) -> &'a Info,
) -> PyResult<Bound<'py, PyDict>> {
    let mut mask = vec![which.is_none(); n];
    for &i in which.unwrap_or_default() {
        mask[i] = true;
    }
    let dict = PyDict::new(py);
    tell(&mut Many {
        dict: &dict,
        which,
        mask,
        of,
    })?;
    Ok(dict)
}

struct Many<'py, 'a, F> {
    dict: &'a Bound<'py, PyDict>,
    which: Option<&'a [usize]>,
    mask: Vec<bool>,
    of: F,
}

impl<'py, 'a, F: Fn(usize) -> &'a Info> Many<'py, '_, F> {
    /// Values of a key, and `nothing` for environments that have none.
    fn values<T: Clone>(&self, nothing: T, mut of: impl FnMut(&Info) -> T) -> Vec<T> {
        let n = self.mask.len();
        let Some(which) = self.which else {
            return (0..n).map(|i| of((self.of)(i))).collect();
        };
        let mut values = vec![nothing; n];
        for &i in which {
            values[i] = of((self.of)(i));
        }
        values
    }

    fn set(&self, key: &str, values: impl IntoPyObject<'py>) -> PyResult<()> {
        let py = self.dict.py();
        self.dict.set_item(PyString::intern(py, key), values)?;
        let mask = PyArray1::from_slice(py, &self.mask);
        self.dict
            .set_item(PyString::intern(py, &format!("_{key}")), mask)
    }
}

impl<'a, F: Fn(usize) -> &'a Info> Listener for Many<'_, '_, F> {
    fn number(&mut self, key: &str, of: impl Fn(&Info) -> f64) -> PyResult<()> {
        self.set(key, self.values(0.0, of).into_pyarray(self.dict.py()))
    }

    fn count(&mut self, key: &str, of: impl Fn(&Info) -> i64) -> PyResult<()> {
        self.set(key, self.values(0, of).into_pyarray(self.dict.py()))
    }

    fn name(
        &mut self,
        key: &str,
        names: &[Option<&str>],
        of: impl Fn(&Info) -> usize,
    ) -> PyResult<()> {
        let py = self.dict.py();
        let names: Vec<Py<PyAny>> = names.iter().map(|&name| known(py, name)).collect();
        // No branches: which name it is, nobody can guess.
        let which = self.values(names.len(), of);
        let none = py.None();
        let name = |i: usize| names.get(i).unwrap_or(&none).clone_ref(py);
        let values: Vec<Py<PyAny>> = which.into_iter().map(name).collect();
        self.set(key, values.into_pyarray(py))
    }
}

/// One of a few names, which Python keeps.
fn known(py: Python<'_>, name: Option<&str>) -> Py<PyAny> {
    name.map_or(py.None(), |name| {
        PyString::intern(py, name).into_any().unbind()
    })
}
