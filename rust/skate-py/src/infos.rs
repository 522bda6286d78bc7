//! Infos as people read them: a dict of one environment, or arrays over many as Gymnasium has them.

use numpy::{Element, IntoPyArray, PyArray1};
use pyo3::{
    prelude::*,
    types::{PyDict, PyString},
};
use skate_core::{
    error::EndCause,
    task::{Info, TERMS},
};

/// Tell what infos hold, key by key.
fn tell(to: &mut impl Listener) -> PyResult<()> {
    to.number("time", |info| info.time)?;
    to.count("state_number", |info| info.state_number.into())?;
    to.name("support_leg", |info| Some(info.leg.name()))?;
    to.count("steps", |info| info.steps as i64)?;
    to.number("flight_time", |info| info.flight_time)?;
    to.number("double_support_time", |info| info.double_support_time)?;
    to.number("y_position", |info| info.y_position)?;
    to.name("end_cause", |info| info.end.map(EndCause::name))?;
    for (i, term) in TERMS.iter().enumerate() {
        to.number(&format!("reward_{term}"), |info| info.terms[i])?;
    }
    Ok(())
}

trait Listener {
    fn number(&mut self, key: &str, of: impl Fn(&Info) -> f64) -> PyResult<()>;
    fn count(&mut self, key: &str, of: impl Fn(&Info) -> i64) -> PyResult<()>;
    fn name(&mut self, key: &str, of: impl Fn(&Info) -> Option<&'static str>) -> PyResult<()>;
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

    fn name(&mut self, key: &str, of: impl Fn(&Info) -> Option<&'static str>) -> PyResult<()> {
        let name = of(self.info).map(|name| PyString::intern(self.dict.py(), name));
        self.set(key, name)
    }
}

/// Of some of `n` environments: an array a key, with zeros and None for the others, and a mask `_key` of those
/// some.
pub fn many<'py, 'a>(
    py: Python<'py>,
    n: usize,
    infos: impl Iterator<Item = (usize, &'a Info)> + Clone,
) -> PyResult<Bound<'py, PyDict>> {
    let mut which = vec![false; n];
    for (i, _) in infos.clone() {
        which[i] = true;
    }
    let dict = PyDict::new(py);
    tell(&mut Many {
        dict: &dict,
        which,
        infos,
    })?;
    Ok(dict)
}

struct Many<'py, 'a, I> {
    dict: &'a Bound<'py, PyDict>,
    which: Vec<bool>,
    infos: I,
}

impl<'py, 'a, I: Iterator<Item = (usize, &'a Info)> + Clone> Many<'py, '_, I> {
    /// Values that are all nothing but for what `of` makes of the infos.
    fn set<T: Element>(
        &self,
        key: &str,
        nothing: impl Fn(Python<'py>) -> T,
        mut of: impl FnMut(&Info) -> T,
    ) -> PyResult<()> {
        let py = self.dict.py();
        let mut values: Vec<T> = self.which.iter().map(|_| nothing(py)).collect();
        for (i, info) in self.infos.clone() {
            values[i] = of(info);
        }
        self.dict
            .set_item(PyString::intern(py, key), values.into_pyarray(py))?;
        let mask = PyArray1::from_slice(py, &self.which);
        self.dict
            .set_item(PyString::intern(py, &format!("_{key}")), mask)
    }
}

impl<'a, I: Iterator<Item = (usize, &'a Info)> + Clone> Listener for Many<'_, '_, I> {
    fn number(&mut self, key: &str, of: impl Fn(&Info) -> f64) -> PyResult<()> {
        self.set(key, |_| 0.0, of)
    }

    fn count(&mut self, key: &str, of: impl Fn(&Info) -> i64) -> PyResult<()> {
        self.set(key, |_| 0, of)
    }

    fn name(&mut self, key: &str, of: impl Fn(&Info) -> Option<&'static str>) -> PyResult<()> {
        let py = self.dict.py();
        // There are few names: each is made once.
        let mut known: Vec<(Option<&str>, Py<PyAny>)> = vec![(None, py.None())];
        self.set(
            key,
            |py| py.None(),
            |info| {
                let name = of(info);
                let made = known.iter().find(|(known, _)| *known == name);
                if let Some((_, made)) = made {
                    return made.clone_ref(py);
                }
                let made = PyString::intern(py, name.unwrap_or_default());
                known.push((name, made.clone().into_any().unbind()));
                made.into_any().unbind()
            },
        )
    }
}
