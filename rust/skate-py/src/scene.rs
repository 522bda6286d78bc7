//! Python class `Scene`.

use crate::arrays::{self, Argument, value_error};
use pyo3::{prelude::*, types::PyDict};
use skate_core::{
    error::Invalid,
    numeric::checksum::checksum,
    scene::{self, effects::EFFECTS},
};
use std::collections::BTreeMap;

/// Validated, immutable description of a simulation; compared by its fields.
///
/// Examples
/// --------
/// >>> import skate_env
/// >>> scene = skate_env.load_scene("paper").with_values({"ice.friction.mu_forward": 0.1})
/// >>> scene.get("ice.friction.mu_forward")
/// 0.1
#[pyclass(frozen, eq, module = "skate_env._core")]
#[derive(PartialEq)]
pub struct Scene {
    pub inner: scene::Scene,
}

#[pymethods]
impl Scene {
    /// Parse the text of a scene file; ValueError names the field and the valid values.
    #[staticmethod]
    fn from_toml(text: Argument<'_, '_>) -> PyResult<Self> {
        Self::checked(scene::Scene::from_toml(&arrays::text("text", text)?))
    }

    /// Parse JSON with the fields of `to_json`; missing fields have their defaults.
    #[staticmethod]
    fn from_json(text: Argument<'_, '_>) -> PyResult<Self> {
        Self::checked(scene::Scene::from_json(&arrays::text("text", text)?))
    }

    /// All fields, including defaults, as TOML.
    fn to_toml(&self) -> String {
        self.inner.to_toml()
    }

    /// All fields, including defaults, as JSON.
    fn to_json(&self) -> String {
        self.inner.to_json()
    }

    /// Return a field, or a table of fields as a dict, by its dotted name.
    ///
    /// None for the field of an effect that is off, so `get("control.lifting.ahead")` is None
    /// without lifting. ValueError lists the valid names.
    fn get<'py>(&self, py: Python<'py>, name: Argument<'_, '_>) -> PyResult<Bound<'py, PyAny>> {
        let name = arrays::text("name", name)?;
        let value = self.inner.field(&name).map_err(value_error)?;
        py.import("json")?.call_method1("loads", (value,))
    }

    /// Name of every effect, and whether it is enabled.
    fn effects<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyDict>> {
        let dict = PyDict::new(py);
        for effect in EFFECTS {
            dict.set_item(effect.name, effect.is_on(&self.inner))?;
        }
        Ok(dict)
    }

    /// Copy the scene without an effect and without the settings that depend on it.
    ///
    /// ValueError for an unknown name, or if the rest of the scene requires the effect.
    fn without(&self, effect: Argument<'_, '_>) -> PyResult<Self> {
        Self::checked(self.inner.without(&arrays::text("effect", effect)?))
    }

    /// Copy the scene with an effect and its typical parameters; errors as for `without`.
    fn with_effect(&self, effect: Argument<'_, '_>) -> PyResult<Self> {
        Self::checked(self.inner.with(&arrays::text("effect", effect)?))
    }

    /// All parameters by dotted name: value, minimum, maximum, unit.
    ///
    /// Elements of a list count from 0, as in `control.lifting.K_p.2`.
    fn parameters(&self) -> BTreeMap<String, (f64, f64, f64, &'static str)> {
        let parameters = self.inner.parameters().into_iter();
        parameters
            .map(|p| (p.name, (p.value, p.range.low, p.range.high, p.range.unit)))
            .collect()
    }

    /// Copy the scene with other parameters, named as in `parameters`.
    ///
    /// ValueError names the parameter that is unknown or out of range.
    fn with_values(&self, values: Argument<'_, '_>) -> PyResult<Self> {
        let values = arrays::numbers("values", values)?;
        let values = values.iter().map(|(name, x)| (name.as_str(), *x));
        Self::checked(self.inner.with_values(values))
    }

    fn __hash__(&self) -> u64 {
        // 0.0 equals -0.0.
        checksum(self.inner.to_json().replace("-0.0", "0.0").as_bytes())
    }

    fn __reduce__<'py>(&self, py: Python<'py>) -> PyResult<(Bound<'py, PyAny>, (String,))> {
        let make = py.get_type::<Self>().getattr("from_json")?;
        Ok((make, (self.to_json(),)))
    }

    /// Name, a field of the scene.
    #[getter]
    fn name(&self) -> &str {
        &self.inner.name
    }
}

impl Scene {
    fn checked(scene: Result<scene::Scene, Invalid>) -> PyResult<Self> {
        let inner = scene.map_err(value_error)?;
        Ok(Self { inner })
    }
}
