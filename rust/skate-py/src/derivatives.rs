//! Python class `Linearization`.

use crate::arrays::Out2;
use numpy::{IntoPyArray, PyArray1, ndarray};
use pyo3::{prelude::*, types::PyDict};
use skate_core::{derivatives, numeric::stack::with_stack};

/// Matrix of the engine as an array.
fn matrix<'py, M>(py: Python<'py>, m: &M, (rows, columns): (usize, usize)) -> Out2<'py>
where
    M: std::ops::Index<(usize, usize), Output = f64>,
{
    ndarray::Array2::from_shape_fn((rows, columns), |at| m[at]).into_pyarray(py)
}

fn vector<'py>(py: Python<'py>, values: impl Iterator<Item = f64>) -> Bound<'py, PyArray1<f64>> {
    values.collect::<Vec<_>>().into_pyarray(py)
}

/// Derivatives of a motion, from `Simulator.linearize`.
///
/// The state has s = 2 n + 4 entries, see `Simulator.state_vector`.
///
/// Examples
/// --------
/// >>> import skate_env
/// >>> lin = skate_env.Simulator("paper_arms").linearize(until=0.3)
/// >>> lin.A.shape, lin.B.shape, lin.nonsmooth
/// ((42, 42), (42, 16), [])
#[pyclass(module = "skate_env._core", frozen)]
pub struct Linearization(pub derivatives::Linearization);

macro_rules! matrices {
    ($($(#[$attribute:meta])* $name:ident => $field:ident),*) => {
        #[pymethods]
        impl Linearization {
            $(
                #[getter]
                $(#[$attribute])*
                fn $name<'py>(&self, py: Python<'py>) -> Out2<'py> {
                    matrix(py, &self.0.$field, self.0.$field.shape())
                }
            )*

            /// Orthonormal basis of the constraints' tangent space at the start, by column.
            #[getter]
            fn tangent_before<'py>(&self, py: Python<'py>) -> Out2<'py> {
                let basis = with_stack(|| self.0.basis_before());
                matrix(py, &basis, basis.shape())
            }

            /// The same at the end.
            #[getter]
            fn tangent_after<'py>(&self, py: Python<'py>) -> Out2<'py> {
                let basis = with_stack(|| self.0.basis_after());
                matrix(py, &basis, basis.shape())
            }

            /// Start and end of the motion [s].
            #[getter]
            fn time(&self) -> (f64, f64) {
                self.0.time.into()
            }

            /// Reason, time [s] and margin where the derivative may not exist; empty if it does.
            #[getter]
            fn nonsmooth(&self) -> Vec<(&'static str, f64, f64)> {
                let all = self.0.nonsmooth.iter();
                all.map(|x| (x.reason.name(), x.t, x.margin)).collect()
            }

            /// Events in order; those of one instant are one.
            ///
            /// Keys: `time` [s]; `guards`, their descriptions; `state_before`, `state_after`, rows of
            /// Table 2; `support_leg` after it; `guard_rate` of the first guard [unit/s], None at a fixed
            /// time; `saltation` (s, s); `dt_dx`, `dt_du`, `dt_dp`, derivatives of the time.
            #[getter]
            fn events<'py>(&self, py: Python<'py>) -> PyResult<Vec<Bound<'py, PyDict>>> {
                let mut events = Vec::with_capacity(self.0.events.len());
                for event in &self.0.events {
                    let dict = PyDict::new(py);
                    dict.set_item("time", event.t)?;
                    dict.set_item("guards", event.what.clone())?;
                    dict.set_item("state_before", event.from.number())?;
                    dict.set_item("state_after", event.to.number())?;
                    dict.set_item("support_leg", event.leg.name())?;
                    dict.set_item("guard_rate", event.guard_rate)?;
                    let saltation = &event.saltation;
                    dict.set_item("saltation", matrix(py, saltation, saltation.shape()))?;
                    for (name, row) in [
                        ("dt_dx", &event.dt_dx),
                        ("dt_du", &event.dt_du),
                        ("dt_dp", &event.dt_dp),
                    ] {
                        dict.set_item(name, vector(py, row.iter().copied()))?;
                    }
                    events.push(dict);
                }
                Ok(events)
            }
        }
    };
}

matrices!(
    /// Final state by start state (s, s).
    ///
    /// A start state off the constraints is projected first, as by `Simulator.displace`.
    #[pyo3(name = "A")]
    a => A,
    /// Final state by held residual torque (s, n - 3).
    #[pyo3(name = "B")]
    b => B,
    /// Final state by the parameters (s, number of parameters).
    #[pyo3(name = "P")]
    p => P
);
