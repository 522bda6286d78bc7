//! Python class `Scene`.

use crate::arrays::{self, Argument, value_error};
use pyo3::{prelude::*, types::PyDict};
use skate_core::{
    error::Invalid,
    numeric::checksum::checksum,
    scene::{self, effects::EFFECTS},
};
use std::collections::BTreeMap;

#[pyclass(frozen, eq, module = "skate_env._core")]
#[derive(PartialEq)]
pub struct Scene {
    pub inner: scene::Scene,
}

#[pymethods]
impl Scene {
    #[staticmethod]
    fn from_toml(text: Argument<'_, '_>) -> PyResult<Self> {
        Self::checked(scene::Scene::from_toml(&arrays::text("text", text)?))
    }

    #[staticmethod]
    fn from_json(text: Argument<'_, '_>) -> PyResult<Self> {
        Self::checked(scene::Scene::from_json(&arrays::text("text", text)?))
    }

    fn to_toml(&self) -> String {
        self.inner.to_toml()
    }

    fn to_json(&self) -> String {
        self.inner.to_json()
    }

    fn get<'py>(&self, py: Python<'py>, name: Argument<'_, '_>) -> PyResult<Bound<'py, PyAny>> {
        let name = arrays::text("name", name)?;
        let value = self.inner.field(&name).map_err(value_error)?;
        py.import("json")?.call_method1("loads", (value,))
    }

    fn effects<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyDict>> {
        let dict = PyDict::new(py);
        for effect in EFFECTS {
            dict.set_item(effect.name, effect.is_on(&self.inner))?;
        }
        Ok(dict)
    }

    fn without(&self, effect: Argument<'_, '_>) -> PyResult<Self> {
        Self::checked(self.inner.without(&arrays::text("effect", effect)?))
    }

    fn with_effect(&self, effect: Argument<'_, '_>) -> PyResult<Self> {
        Self::checked(self.inner.with(&arrays::text("effect", effect)?))
    }

    fn parameters(&self) -> BTreeMap<String, (f64, f64, f64, &'static str)> {
        let parameters = self.inner.parameters().into_iter();
        parameters
            .map(|p| (p.name, (p.value, p.range.low, p.range.high, p.range.unit)))
            .collect()
    }

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
