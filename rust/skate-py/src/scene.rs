//! `Scene`.

use crate::arrays::value_error;
use pyo3::prelude::*;
use skate_core::{model::Model, scene};

#[pyclass(frozen, module = "skate_env._core")]
pub struct Scene {
    pub inner: scene::Scene,
}

#[pymethods]
impl Scene {
    #[staticmethod]
    fn from_toml(text: &str) -> PyResult<Self> {
        Self::checked(scene::Scene::from_toml(text))
    }

    #[staticmethod]
    fn from_json(text: &str) -> PyResult<Self> {
        Self::checked(scene::Scene::from_json(text))
    }

    fn to_toml(&self) -> String {
        self.inner.to_toml()
    }

    fn to_json(&self) -> String {
        self.inner.to_json()
    }

    #[getter]
    fn name(&self) -> &str {
        &self.inner.name
    }
}

impl Scene {
    fn checked(read: Result<scene::Scene, skate_core::error::Invalid>) -> PyResult<Self> {
        let inner = read.map_err(value_error)?;
        Model::compile(&inner).map_err(value_error)?;
        Ok(Self { inner })
    }
}
