//! Gymnasium infos: a dict for one environment, or a dict of arrays for many.

use numpy::{IntoPyArray, PyArray1};
use pyo3::{
    prelude::*,
    sync::PyOnceLock,
    types::{PyDict, PyList, PyString},
};
use skate_core::{
    batch::Outcome,
    error::Termination,
    scene::Leg,
    task::{ActionResult, Info, TERMS},
};

/// All keys as Python strings.
pub struct Keys {
    time: Key,
    state_number: Key,
    support_leg: Key,
    steps: Key,
    flight_time: Key,
    double_support_time: Key,
    loaded_slide: Key,
    y_position: Key,
    termination: Key,
    rewards: [Key; TERMS.len()],
    truncated_by_time: Py<PyString>,
    terminal_observation: Py<PyString>,
}

/// A key, the key of its mask, and the names of its values.
struct Key {
    plain: Py<PyString>,
    mask: Py<PyString>,
    names: Vec<Py<PyAny>>,
}

impl Key {
    fn new(py: Python<'_>, key: &str, names: &[Option<&str>]) -> Self {
        let keep = |text: &str| PyString::intern(py, text).unbind();
        let name = |name: &Option<&str>| name.map_or(py.None(), |name| keep(name).into_any());
        Self {
            plain: keep(key),
            mask: keep(&format!("_{key}")),
            names: names.iter().map(name).collect(),
        }
    }
}

impl Keys {
    pub fn get(py: Python<'_>) -> &Self {
        static KEYS: PyOnceLock<Keys> = PyOnceLock::new();
        KEYS.get_or_init(py, || {
            let number = |key: &str| Key::new(py, key, &[]);
            let intern = |text: &str| PyString::intern(py, text).unbind();
            let legs = [Leg::Right, Leg::Left].map(|leg| Some(leg.name()));
            let ends = Termination::ALL.map(|end| Some(end.name()));
            let ends: Vec<_> = [None].into_iter().chain(ends).collect();
            Self {
                time: number("time"),
                state_number: number("state_number"),
                support_leg: Key::new(py, "support_leg", &legs),
                steps: number("steps"),
                flight_time: number("flight_time"),
                double_support_time: number("double_support_time"),
                loaded_slide: number("loaded_slide"),
                y_position: number("y_position"),
                termination: Key::new(py, "termination", &ends),
                truncated_by_time: intern("TimeLimit.truncated"),
                terminal_observation: intern("terminal_observation"),
                rewards: TERMS.map(|term| number(&format!("reward_{term}"))),
            }
        })
    }
}

/// Write all entries of infos to a sink.
fn write_all(keys: &Keys, to: &impl InfoSink) -> PyResult<()> {
    to.number(&keys.time, |info| info.time)?;
    to.count(&keys.state_number, |info| info.state_number.into())?;
    to.name(&keys.support_leg, |info| info.leg as usize)?;
    to.count(&keys.steps, |info| info.steps as i64)?;
    to.number(&keys.flight_time, |info| info.flight_time)?;
    to.number(&keys.double_support_time, |info| info.double_support_time)?;
    to.number(&keys.loaded_slide, |info| info.loaded_slide)?;
    to.number(&keys.y_position, |info| info.y_position)?;
    to.name(&keys.termination, |info| {
        info.end.map_or(0, |end| 1 + end as usize)
    })?;
    for (i, key) in keys.rewards.iter().enumerate() {
        to.number(key, |info| info.terms[i])?;
    }
    Ok(())
}

trait InfoSink {
    fn number(&self, key: &Key, of: impl Fn(&Info) -> f64) -> PyResult<()>;
    fn count(&self, key: &Key, of: impl Fn(&Info) -> i64) -> PyResult<()>;
    /// One of the key's names, by index.
    fn name(&self, key: &Key, of: impl Fn(&Info) -> usize) -> PyResult<()>;
}

/// Infos of one environment as plain values.
pub fn single<'py>(py: Python<'py>, info: &Info) -> PyResult<Bound<'py, PyDict>> {
    let dict = PyDict::new(py);
    write_all(Keys::get(py), &Single { dict: &dict, info })?;
    Ok(dict)
}

struct Single<'py, 'a> {
    dict: &'a Bound<'py, PyDict>,
    info: &'a Info,
}

impl InfoSink for Single<'_, '_> {
    fn number(&self, key: &Key, of: impl Fn(&Info) -> f64) -> PyResult<()> {
        self.dict.set_item(&key.plain, of(self.info))
    }

    fn count(&self, key: &Key, of: impl Fn(&Info) -> i64) -> PyResult<()> {
        self.dict.set_item(&key.plain, of(self.info))
    }

    fn name(&self, key: &Key, of: impl Fn(&Info) -> usize) -> PyResult<()> {
        self.dict.set_item(&key.plain, &key.names[of(self.info)])
    }
}

/// Infos of all environments after a step, one dict each, as in Stable-Baselines3. Environments that the
/// step has reset have the final infos.
pub fn each<'py>(py: Python<'py>, outcomes: &[Outcome]) -> PyResult<Bound<'py, PyList>> {
    let keys = Keys::get(py);
    let list = PyList::empty(py);
    for (now, last) in outcomes {
        let ActionResult {
            info,
            terminated,
            truncated,
            ..
        } = last.as_deref().map_or(now, |last| &last.result);
        let dict = single(py, info)?;
        dict.set_item(&keys.truncated_by_time, *truncated && !terminated)?;
        if let Some(last) = last {
            let observation = PyArray1::from_slice(py, &last.observation);
            dict.set_item(&keys.terminal_observation, observation)?;
        }
        list.append(dict)?;
    }
    Ok(list)
}

/// Infos of all environments after a step, with the final infos of environments that the step has reset.
pub fn of_step<'py>(py: Python<'py>, outcomes: &[Outcome]) -> PyResult<Bound<'py, PyDict>> {
    let n = outcomes.len();
    let dict = many(py, n, None, |i| &outcomes[i].0.info)?;
    let mut which = Vec::new();
    let mut observations: Vec<Py<PyAny>> = Vec::new();
    for (i, (_, last)) in outcomes.iter().enumerate() {
        if let Some(last) = last {
            which.push(i);
            observations.resize_with(i, || py.None());
            let observation = PyArray1::from_slice(py, &last.observation);
            observations.push(observation.into_any().unbind());
        }
    }
    if which.is_empty() {
        return Ok(dict);
    }
    observations.resize_with(n, || py.None());
    let infos = many(py, n, Some(&which), |i| {
        let (row, last) = &outcomes[i];
        last.as_deref().map_or(&row.info, |last| &last.result.info)
    })?;
    let mask = || PyArray1::from_iter(py, outcomes.iter().map(|(_, last)| last.is_some()));
    dict.set_item("final_obs", observations.into_pyarray(py))?;
    dict.set_item("_final_obs", mask())?;
    dict.set_item("final_info", infos)?;
    dict.set_item("_final_info", mask())?;
    Ok(dict)
}

/// Infos of `n` environments, or of some of them: an array per key and a mask `_key`. Missing entries are
/// zero or None.
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
    let many = Many {
        dict: &dict,
        which,
        mask,
        of,
    };
    write_all(Keys::get(py), &many)?;
    Ok(dict)
}

struct Many<'py, 'a, F> {
    dict: &'a Bound<'py, PyDict>,
    which: Option<&'a [usize]>,
    mask: Vec<bool>,
    of: F,
}

impl<'py, 'a, F: Fn(usize) -> &'a Info> Many<'py, '_, F> {
    /// Values of a key, with `nothing` where there is none.
    fn values<T: Clone>(&self, nothing: T, of: impl Fn(&Info) -> T) -> Vec<T> {
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

    fn set(&self, key: &Key, values: impl IntoPyObject<'py>) -> PyResult<()> {
        self.dict.set_item(&key.plain, values)?;
        let mask = PyArray1::from_slice(self.dict.py(), &self.mask);
        self.dict.set_item(&key.mask, mask)
    }
}

impl<'a, F: Fn(usize) -> &'a Info> InfoSink for Many<'_, '_, F> {
    fn number(&self, key: &Key, of: impl Fn(&Info) -> f64) -> PyResult<()> {
        self.set(key, self.values(0.0, of).into_pyarray(self.dict.py()))
    }

    fn count(&self, key: &Key, of: impl Fn(&Info) -> i64) -> PyResult<()> {
        self.set(key, self.values(0, of).into_pyarray(self.dict.py()))
    }

    fn name(&self, key: &Key, of: impl Fn(&Info) -> usize) -> PyResult<()> {
        let py = self.dict.py();
        let none = py.None();
        // No branches, because they are not predictable.
        let which = self.values(key.names.len(), of);
        let name = |i: usize| key.names.get(i).unwrap_or(&none).clone_ref(py);
        let values: Vec<Py<PyAny>> = which.into_iter().map(name).collect();
        self.set(key, values.into_pyarray(py))
    }
}
