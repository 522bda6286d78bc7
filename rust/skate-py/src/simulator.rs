//! Python class `Simulator`.

use crate::{
    arrays::{
        Argument, Out2, bytes, instant, integer, leg, names, number, numbers, reals, square, text,
        type_error, value_error, vector,
    },
    derivatives::Linearization,
    scene::Scene,
    signals::interruptible,
    tables,
};
use numpy::{IntoPyArray, PyArray1, PyArray3, ndarray};
use pyo3::{
    exceptions::{PyKeyboardInterrupt, PyValueError},
    prelude::*,
    types::{PyBytes, PyDict},
};
use skate_core::{
    derivatives::state_size,
    dynamics::bias_forces,
    error::{Invalid, Termination},
    model::{
        Model,
        contact_mode::SoleContact,
        layout::{NV, ROOT},
    },
    numeric::stack::with_stack,
    rhs::{Evaluation, link_segments},
    sim::Simulation,
    task::{self, perturbed},
    timing::{self, Operation},
};

#[pyclass(module = "skate_env._core")]
pub struct Simulator {
    /// Scene as given; an episode may have other parameters.
    scene: skate_core::scene::Scene,
    // Boxed, because Python objects are not aligned to cache lines.
    sim: Box<Simulation>,
}

/// Maximum duration of one call of `advance` [s].
const MAX_TIME: f64 = 1e4;

/// Error where the accelerations do not exist.
fn ended(cause: Termination) -> PyErr {
    PyValueError::new_err(format!("no accelerations at this state: {}", cause.name()))
}

type Out1<'py> = Bound<'py, PyArray1<f64>>;

impl Simulator {
    /// Simulator of a scene at a given state.
    pub fn around(sim: Box<Simulation>, scene: skate_core::scene::Scene) -> Self {
        Self { scene, sim }
    }

    fn n(&self) -> usize {
        self.sim.model.n
    }

    fn out<'py>(&self, py: Python<'py>, x: &[f64; NV]) -> Out1<'py> {
        PyArray1::from_slice(py, &x[..self.n()])
    }

    fn residual(&self, torque: Option<Argument<'_, '_>>) -> PyResult<[f64; NV]> {
        match torque {
            Some(torque) => vector("residual_torque", torque, self.n() - ROOT),
            None => Ok([0.0; NV]),
        }
    }

    /// End time of a motion from the present.
    fn until(&self, until: Argument<'_, '_>) -> PyResult<f64> {
        let now = self.sim.state.t;
        let until = number("until", until)?;
        Invalid::range("until", until, now, now + MAX_TIME, "s").map_err(value_error)?;
        Ok(until)
    }

    fn at(
        &self,
        t: Argument<'_, '_>,
        q: Argument<'_, '_>,
        v: Argument<'_, '_>,
    ) -> PyResult<(f64, [f64; NV], [f64; NV])> {
        let n = self.n();
        Ok((instant(t)?, vector("q", q, n)?, vector("v", v, n)?))
    }

    /// Advance with a residual torque; false after termination.
    fn advance_to(&mut self, py: Python<'_>, until: f64, residual: &[f64; NV]) -> PyResult<bool> {
        interruptible(py, |go_on| {
            self.sim.hold(&residual[..self.sim.model.n - ROOT]);
            self.sim.advance_while(until, go_on);
        })?;
        Ok(self.sim.ended.is_none())
    }

    /// Kinematics at (q, v), whose reference is the supporting foot's toe.
    fn moved(&self, q: &[f64; NV], v: &[f64; NV]) -> Evaluation {
        let mut eval = Evaluation::default();
        eval.set_configuration(&self.sim.model, SoleContact::Toe, q, v);
        eval.inertias.update(&self.sim.model, &eval.kin);
        eval
    }
}

#[pymethods]
impl Simulator {
    #[new]
    fn new(scene: Argument<'_, '_>) -> PyResult<Self> {
        let given = scene;
        let scene = given.cast::<Scene>();
        let scene = scene
            .map_err(|_| type_error("scene", given, "a Scene"))?
            .get();
        let model = Model::compile(&scene.inner).map_err(value_error)?;
        let sim = with_stack(|| Simulation::new(model).map(Box::new));
        Ok(Self::around(sim.map_err(value_error)?, scene.inner.clone()))
    }

    #[getter]
    fn scene(&self) -> Scene {
        Scene {
            inner: self.sim.model.scene.clone(),
        }
    }

    #[getter]
    fn coordinate_names(&self) -> Vec<&'static str> {
        self.sim.model.names.clone()
    }

    fn size<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyDict>> {
        tables::size(py, &self.sim)
    }

    #[getter]
    fn action_period(&self) -> f64 {
        self.sim.model.scene.control.action_period
    }

    fn bodies<'py>(&self, py: Python<'py>) -> PyResult<Vec<Bound<'py, PyDict>>> {
        tables::bodies(py, &self.sim)
    }

    #[getter]
    fn time(&self) -> f64 {
        self.sim.state.t
    }

    #[getter]
    fn q<'py>(&self, py: Python<'py>) -> Out1<'py> {
        self.out(py, &self.sim.coordinates().q)
    }

    #[getter]
    fn v<'py>(&self, py: Python<'py>) -> Out1<'py> {
        self.out(py, &self.sim.coordinates().v)
    }

    #[getter]
    fn support_leg(&self) -> &'static str {
        self.sim.state.support_leg.name()
    }

    #[getter]
    fn state_number(&self) -> u8 {
        self.sim.state.mode.number()
    }

    #[getter]
    fn state_name(&self) -> String {
        self.sim.state.mode.name()
    }

    #[getter]
    fn termination(&self) -> Option<&'static str> {
        self.sim.ended.map(|cause| cause.name())
    }

    #[getter]
    fn torque<'py>(&self, py: Python<'py>) -> Out1<'py> {
        self.out(py, &self.sim.evaluation().tau)
    }

    #[getter]
    fn acceleration<'py>(&self, py: Python<'py>) -> Out1<'py> {
        self.out(py, &self.sim.accelerations())
    }

    #[getter]
    fn contact_forces<'py>(&self, py: Python<'py>) -> Out2<'py> {
        let (sim, solution) = (&self.sim, &self.sim.eval.solution);
        let [support, free] = sim.eval.loads(&sim.model, sim.state.mode);
        let row = |along: f64, [heel, toe]: [f64; 2]| [along, heel + toe, heel, toe];
        // Viscous friction is part of the damping matrix D.
        let drag = sim.model.damping[0] * sim.state.v[0];
        let rows = [
            row(solution.f_root[0] - drag, support),
            row(solution.lam[0], free),
        ];
        ndarray::arr2(&rows).into_pyarray(py)
    }

    #[getter]
    fn head_position<'py>(&self, py: Python<'py>) -> Out1<'py> {
        self.sim.head().to_vec().into_pyarray(py)
    }

    fn observation<'py>(&self, py: Python<'py>) -> Bound<'py, PyArray1<f32>> {
        task::observation(&self.sim).into_pyarray(py)
    }

    #[pyo3(signature = (q = None))]
    fn link_segments<'py>(
        &self,
        py: Python<'py>,
        q: Option<Argument<'_, 'py>>,
    ) -> PyResult<Bound<'py, PyArray3<f64>>> {
        let q = match q {
            Some(q) => vector("q", q, self.n())?,
            None => self.sim.coordinates().q,
        };
        let eval = self.moved(&q, &[0.0; NV]);
        let model = &self.sim.model;
        let segments =
            link_segments::segments(model, &eval, (q[0], q[1]), self.sim.state.support_leg);
        Ok(ndarray::arr3(&segments).into_pyarray(py))
    }

    #[pyo3(signature = (q = None, v = None, support_leg = None, params = None))]
    fn reset(
        &mut self,
        q: Option<Argument<'_, '_>>,
        v: Option<Argument<'_, '_>>,
        support_leg: Option<Argument<'_, '_>>,
        params: Option<Argument<'_, '_>>,
    ) -> PyResult<()> {
        let n = self.n();
        let changed = params.map(|params| {
            let params = numbers("params", params)?;
            let values = params.iter().map(|(name, x)| (name.as_str(), *x));
            self.scene.with_values(values).map_err(value_error)
        });
        let changed = changed.transpose()?;
        let scene = changed.as_ref().unwrap_or(&self.scene);
        let q = match q {
            Some(q) => vector("q", q, n)?,
            None => self.sim.model.from_names(&scene.start.q),
        };
        let v = match v {
            Some(v) => vector("v", v, n)?,
            None => self.sim.model.from_names(&scene.start.v),
        };
        let leg = match support_leg {
            Some(given) => leg(given)?,
            None => scene.start.support_leg,
        };
        let reset = || {
            if *scene == self.sim.model.scene {
                return self.sim.reset(&q, &v, leg);
            }
            let mut sim = self.sim.clone();
            sim.set_model(Model::compile(scene)?)?;
            sim.reset(&q, &v, leg)?;
            self.sim = sim;
            Ok(())
        };
        with_stack(reset).map_err(value_error)
    }

    fn perturb(&mut self, sigma: Argument<'_, '_>, seed: Argument<'_, '_>) -> PyResult<()> {
        let (sigma, seed) = (
            number("perturb", sigma)?,
            integer("seed", seed, 0, u64::MAX)?,
        );
        let perturb = || {
            let mut sim = self.sim.clone();
            // The episode may have had other parameters than the scene.
            if self.scene != sim.model.scene {
                sim.set_model(Model::compile(&self.scene)?)?;
            }
            perturbed(&mut sim, sigma, seed)?;
            self.sim = sim;
            Ok(())
        };
        with_stack(perturb).map_err(value_error)
    }

    fn kick(&mut self, speed: Argument<'_, '_>) -> PyResult<bool> {
        let speed = number("speed", speed)?;
        self.sim.kick(speed).map_err(value_error)?;
        Ok(self.sim.ended.is_none())
    }

    #[pyo3(signature = (residual_torque = None))]
    fn step(
        &mut self,
        py: Python<'_>,
        residual_torque: Option<Argument<'_, '_>>,
    ) -> PyResult<bool> {
        let residual = self.residual(residual_torque)?;
        let until = self.sim.next_action_time();
        self.advance_to(py, until, &residual)
    }

    #[pyo3(signature = (until, residual_torque = None))]
    fn advance(
        &mut self,
        py: Python<'_>,
        until: Argument<'_, '_>,
        residual_torque: Option<Argument<'_, '_>>,
    ) -> PyResult<bool> {
        let until = self.until(until)?;
        let residual = self.residual(residual_torque)?;
        self.advance_to(py, until, &residual)
    }

    #[pyo3(signature = (residual_torque = None, until = None, params = None))]
    fn linearize(
        &self,
        py: Python<'_>,
        residual_torque: Option<Argument<'_, '_>>,
        until: Option<Argument<'_, '_>>,
        params: Option<Argument<'_, '_>>,
    ) -> PyResult<Linearization> {
        let residual = self.residual(residual_torque)?;
        let until = match until {
            Some(until) => self.until(until)?,
            None => self.sim.next_action_time(),
        };
        let params = params.map_or(Ok(vec![]), |params| names("params", params))?;
        let done = interruptible(py, |go_on| {
            let residual = &residual[..self.n() - ROOT];
            let mut sim = self.sim.clone();
            sim.linearize(residual, until, &params, go_on)
        })?;
        let done = done.map_err(value_error)?;
        // Without a result a signal has raised above.
        done.map(Linearization)
            .ok_or_else(|| PyKeyboardInterrupt::new_err("linearize"))
    }

    fn state_vector<'py>(&self, py: Python<'py>) -> Out1<'py> {
        self.sim.state_vector().into_pyarray(py)
    }

    fn displace(&mut self, dx: Argument<'_, '_>) -> PyResult<bool> {
        let dx = reals("dx", dx, &[state_size(self.n())])?;
        self.sim.displace(&dx).map_err(value_error)?;
        Ok(self.sim.ended.is_none())
    }

    fn rhs<'py>(
        &self,
        py: Python<'py>,
        t: Argument<'_, 'py>,
        q: Argument<'_, 'py>,
        v: Argument<'_, 'py>,
    ) -> PyResult<Out1<'py>> {
        let (t, q, v) = self.at(t, q, v)?;
        let accelerations = self.sim.accelerations_at(t, &q, &v).map_err(ended)?;
        Ok(self.out(py, &accelerations))
    }

    fn guards<'py>(
        &self,
        py: Python<'py>,
        t: Argument<'_, 'py>,
        q: Argument<'_, 'py>,
        v: Argument<'_, 'py>,
    ) -> PyResult<Bound<'py, PyDict>> {
        let (t, q, v) = self.at(t, q, v)?;
        let dict = PyDict::new(py);
        for (guard, value) in self.sim.guards_at(t, &q, &v).map_err(ended)? {
            dict.set_item(guard.describe(), value)?;
        }
        Ok(dict)
    }

    fn sampled(
        &self,
        t: Argument<'_, '_>,
        q: Argument<'_, '_>,
        v: Argument<'_, '_>,
    ) -> PyResult<bool> {
        let (t, q, v) = self.at(t, q, v)?;
        Ok(self.sim.controller_would_change(t, &q, &v))
    }

    #[pyo3(signature = (t, q, v, guard = None))]
    fn reset_map(
        &mut self,
        t: Argument<'_, '_>,
        q: Argument<'_, '_>,
        v: Argument<'_, '_>,
        guard: Option<Argument<'_, '_>>,
    ) -> PyResult<bool> {
        let (t, q, v) = self.at(t, q, v)?;
        let guard = guard.map(|guard| text("guard", guard)).transpose()?;
        let passed = self.sim.reset_map(t, &q, &v, guard.as_deref());
        passed.map_err(value_error)?;
        Ok(self.sim.ended.is_none())
    }

    fn measure(
        &self,
        py: Python<'_>,
        work: Argument<'_, '_>,
        repeats: Argument<'_, '_>,
    ) -> PyResult<f64> {
        let work = Operation::from_name(&text("work", work)?).map_err(value_error)?;
        let repeats = integer("repeats", repeats, 1, u32::MAX.into())? as u32;
        let spent = interruptible(py, |go_on| timing::time(&self.sim, work, repeats, go_on))?;
        Ok(spent.map_err(value_error)?.as_secs_f64())
    }

    fn gaps<'py>(&self, py: Python<'py>) -> Out2<'py> {
        ndarray::arr2(&self.sim.sole_points.gaps).into_pyarray(py)
    }

    fn violation(&self) -> (f64, f64) {
        self.sim.violation()
    }

    fn take_events(&mut self) -> Vec<(f64, &'static str, u8, u8, &'static str)> {
        let events = self.sim.take_events().into_iter();
        events
            .map(|e| (e.t, e.what, e.from.number(), e.to.number(), e.leg.name()))
            .collect()
    }

    fn take_steps<'py>(&mut self, py: Python<'py>) -> PyResult<Vec<Bound<'py, PyDict>>> {
        tables::steps(py, &mut self.sim)
    }

    fn stats<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyDict>> {
        tables::stats(py, &self.sim)
    }

    fn totals<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyDict>> {
        tables::totals(py, &self.sim)
    }

    fn energy_balance<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyDict>> {
        tables::energy_balance(py, &self.sim)
    }

    #[pyo3(signature = (on = true))]
    fn check_laws(&mut self, on: bool) {
        self.sim.check(on);
    }

    fn laws<'py>(&self, py: Python<'py>) -> PyResult<Vec<Bound<'py, PyDict>>> {
        tables::laws(py, &self.sim)
    }

    fn snapshot(&self) -> Vec<u8> {
        self.sim.snapshot()
    }

    fn restore(&mut self, data: Argument<'_, '_>) -> PyResult<()> {
        let data = bytes("data", data)?;
        with_stack(|| self.sim.restore(data)).map_err(value_error)
    }

    // Pickling and copying: construct from the scene, then restore the state.

    fn __getnewargs__(&self) -> (Scene,) {
        let inner = self.scene.clone();
        (Scene { inner },)
    }

    fn __getstate__<'py>(&self, py: Python<'py>) -> Bound<'py, PyBytes> {
        PyBytes::new(py, &self.sim.snapshot())
    }

    fn __setstate__(&mut self, data: Argument<'_, '_>) -> PyResult<()> {
        self.restore(data)
    }

    fn mass_matrix<'py>(&self, py: Python<'py>, q: Argument<'_, 'py>) -> PyResult<Out2<'py>> {
        let n = self.n();
        let eval = self.moved(&vector("q", q, n)?, &[0.0; NV]);
        let inertia = eval.inertias.crba(&self.sim.model, &eval.kin);
        square(py, inertia.as_slice().to_vec(), n)
    }

    fn bias_forces<'py>(
        &self,
        py: Python<'py>,
        q: Argument<'_, 'py>,
        v: Argument<'_, 'py>,
    ) -> PyResult<Out1<'py>> {
        let n = self.n();
        let eval = self.moved(&vector("q", q, n)?, &vector("v", v, n)?);
        let mut out = [0.0; NV];
        eval.inertias
            .inverse_dynamics(&self.sim.model, &eval.kin, &[0.0; NV], &mut out);
        Ok(self.out(py, &out))
    }

    fn energy(&self, q: Argument<'_, '_>, v: Argument<'_, '_>) -> PyResult<(f64, f64)> {
        let (q, v) = (vector("q", q, self.n())?, vector("v", v, self.n())?);
        let eval = self.moved(&q, &v);
        Ok(bias_forces::energy(&self.sim.model, &eval.kin, &v, q[1]))
    }

    fn momentum<'py>(
        &self,
        py: Python<'py>,
        q: Argument<'_, 'py>,
        v: Argument<'_, 'py>,
    ) -> PyResult<Out1<'py>> {
        let (q, v) = (vector("q", q, self.n())?, vector("v", v, self.n())?);
        let eval = self.moved(&q, &v);
        let ([py_, pz], about_toe) = eval.inertias.momentum(&self.sim.model, &eval.kin);
        // Change the reference point from the toe to the world's origin.
        let about_origin = about_toe + q[0] * pz - q[1] * py_;
        Ok(vec![py_, pz, about_origin].into_pyarray(py))
    }
}
