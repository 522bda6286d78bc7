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

/// Simulation of one robot.
///
/// One thread at a time uses an object: a call during another one, which releases the interpreter,
/// raises RuntimeError ("Already borrowed") and changes nothing.
///
/// Examples
/// --------
/// >>> import skate_env
/// >>> sim = skate_env.Simulator("paper")
/// >>> while sim.step() and sim.time < 1.0:
/// ...     pass
/// >>> sim.support_leg, sim.contact_forces.shape
/// ('left', (2, 4))
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

    /// Scene of the present episode, with the parameters of its reset.
    #[getter]
    fn scene(&self) -> Scene {
        Scene {
            inner: self.sim.model.scene.clone(),
        }
    }

    /// The n names, root first: `["y0", "z0", "q1", "q2", ...]`.
    #[getter]
    fn coordinate_names(&self) -> Vec<&'static str> {
        self.sim.model.names.clone()
    }

    /// Sizes of the model.
    ///
    /// Keys: `dof`, coordinates that move in at least one contact state; `rows`, maximum number of
    /// multipliers of the free foot; `guards`, number of different guards; `accelerations` and
    /// `multipliers`, unknowns of Table 2 in the present contact state.
    fn size<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyDict>> {
        tables::size(py, &self.sim)
    }

    /// Duration of one `step` [s].
    #[getter]
    fn action_period(&self) -> f64 {
        self.sim.model.scene.control.action_period
    }

    /// Rigid bodies in the order of the coordinates; a locked joint merges its two bodies.
    ///
    /// Keys: `name`, `joint` (coordinate name; the first body carries `y0, z0, q1`), `parent`
    /// (index, -1 for the first), `axis` ("x", "y" or "z"), `offset` (3,) of its joint in the
    /// parent's frame [m], `mass` [kg], `com` (3,) in its own frame [m], `inertia` (3, 3) about
    /// its centre of mass in its own frame [kg m2], `damping` of its joint [N m s/rad].
    fn bodies<'py>(&self, py: Python<'py>) -> PyResult<Vec<Bound<'py, PyDict>>> {
        tables::bodies(py, &self.sim)
    }

    /// Simulation time [s], 0 after a reset.
    #[getter]
    fn time(&self) -> f64 {
        self.sim.state.t
    }

    /// Coordinates (n,), a copy.
    #[getter]
    fn q<'py>(&self, py: Python<'py>) -> Out1<'py> {
        self.out(py, &self.sim.coordinates().q)
    }

    /// Velocities (n,), a copy.
    #[getter]
    fn v<'py>(&self, py: Python<'py>) -> Out1<'py> {
        self.out(py, &self.sim.coordinates().v)
    }

    /// `"right"` or `"left"`.
    #[getter]
    fn support_leg(&self) -> &'static str {
        self.sim.state.support_leg.name()
    }

    /// Row of Table 2, 1 to 20; 0 in flight.
    #[getter]
    fn state_number(&self) -> u8 {
        self.sim.state.mode.number()
    }

    /// Contact state as supporting foot / free foot, for example `slide_flat/slide_heel`.
    #[getter]
    fn state_name(&self) -> String {
        self.sim.state.mode.name()
    }

    /// Cause of termination, or None while the simulation can continue.
    ///
    /// `fall`, `jam`, `singular`, `step_limit`, `overspeed`, `not_finite` or `wedged`; see
    /// `docs/hard-cases.md`. In environments also `no_step`: no step for too long.
    #[getter]
    fn termination(&self) -> Option<&'static str> {
        self.sim.ended.map(|cause| cause.name())
    }

    /// Generalised torque at the present instant (n,): baseline plus residual.
    #[getter]
    fn torque<'py>(&self, py: Python<'py>) -> Out1<'py> {
        self.out(py, &self.sim.evaluation().tau)
    }

    /// Accelerations at the present instant (n,).
    #[getter]
    fn acceleration<'py>(&self, py: Python<'py>) -> Out1<'py> {
        self.out(py, &self.sim.accelerations())
    }

    /// (2, 4) [N]: rows supporting, free foot; columns f_y, N, N at the heel, N at the toe.
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

    /// Top of the head in the world (3,) [m].
    #[getter]
    fn head_position<'py>(&self, py: Python<'py>) -> Out1<'py> {
        self.sim.head().to_vec().into_pyarray(py)
    }

    /// Observation of the present state (d,), as an environment on the same scene returns it.
    ///
    /// `IceSkateEnv.observation_names` lists the entries.
    fn observation<'py>(&self, py: Python<'py>) -> Bound<'py, PyArray1<f32>> {
        task::observation(&self.sim).into_pyarray(py)
    }

    /// (17, 2, 3) [m]: both ends of every link of Table 1 in the world, in the paper's order.
    ///
    /// The segment of a foot is its sole, heel to toe. `q=None` means the present state.
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

    /// Reset to the scene's start, or to the given state, at t = 0.
    ///
    /// `q`, `v` and `support_leg` of any simulation of the scene give that state bit for bit. The
    /// controller starts anew: other torques may open a contact at once. A state in single
    /// precision is projected onto the ice, by micrometres and micrometres per second.
    ///
    /// `params` replaces parameters for this episode, named as in `Scene.parameters`: friction,
    /// masses, lengths, gains, gravity. The next reset uses the scene's own values again.
    ///
    /// ValueError, with nothing changed, if the state is not finite, has the wrong shape or is
    /// below the ice, or if a parameter is unknown or out of range.
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

    /// Reset to the scene's start with a random disturbance; the support stays flat.
    ///
    /// Normal noise is added to the leg angles q2 .. q7 (``sigma`` rad) and to their rates
    /// (``sigma`` rad/s), and the skating speed is multiplied by ``1 + sigma * n``. A draw
    /// with the free foot below the ice is repeated, up to 100 times.
    ///
    /// ValueError, with nothing changed, if ``sigma`` is outside [0, 10] or no draw is valid.
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

    /// Add ``speed`` [m/s], -10 to 10, to the forward velocity of every body instantaneously.
    ///
    /// Joint rates do not change; feet on the ice slide in their new direction. No effect after
    /// termination. Returns whether the simulation can continue.
    ///
    /// ValueError, with nothing changed, if ``speed`` is out of range, or not 0 on sticking ice.
    fn kick(&mut self, speed: Argument<'_, '_>) -> PyResult<bool> {
        let speed = number("speed", speed)?;
        self.sim.kick(speed).map_err(value_error)?;
        Ok(self.sim.ended.is_none())
    }

    /// Advance one action period with a constant residual (16 or n - 3 joint torques) [N m].
    ///
    /// Returns True while the simulation can continue; otherwise `termination` is the cause.
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

    /// Advance to the time ``until`` [s] with a constant residual torque (n - 3,) [N m].
    ///
    /// Returns whether the simulation can continue. ValueError for a time in the past. After
    /// KeyboardInterrupt `time` is the end of the last time step, before ``until``.
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

    /// Differentiate the motion to the time ``until`` [s]; the simulator does not change.
    ///
    /// Parameters
    /// ----------
    /// residual_torque
    ///     Torque that is held (n - 3,) [N m]; None for zero.
    /// until
    ///     End of the motion [s]; None for the end of the action period.
    /// params
    ///     Parameters to differentiate by, named as in `Scene.parameters`.
    ///
    /// Raises
    /// ------
    /// ValueError
    ///     For rosenbrock, a time in the past, a parameter that is unknown, repeated, or selects
    ///     start, accuracy or sample times, any parameter with time stepping (`fast`), or a motion
    ///     that terminates or is stiff.
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

    /// Differentiated state (2 n + 4,): q, v, anchor of the free foot, times t0, t1, t2.
    fn state_vector<'py>(&self, py: Python<'py>) -> Out1<'py> {
        self.sim.state_vector().into_pyarray(py)
    }

    /// Add ``dx`` (2 n + 4,) to the state and project it onto the mode's constraints.
    ///
    /// Contact state and time do not change. Returns whether the simulation can continue.
    /// ValueError where an entry of the state leaves [-1e6, 1e6]; then nothing has changed.
    fn displace(&mut self, dx: Argument<'_, '_>) -> PyResult<bool> {
        let dx = reals("dx", dx, &[state_size(self.n())])?;
        self.sim.displace(&dx).map_err(value_error)?;
        Ok(self.sim.ended.is_none())
    }

    /// Accelerations (n,) in the present contact state with the present controller state.
    ///
    /// ValueError if the contact forces have no solution.
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

    /// Guards of the present contact state; an event occurs when one decreases through zero.
    ///
    /// Exception: ``free toe lands`` also fires when it increases through zero, in two-way contact
    /// without contact of the toe alone.
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

    /// Whether a controller sample at this state would change the controller state.
    fn sampled(
        &self,
        t: Argument<'_, '_>,
        q: Argument<'_, '_>,
        v: Argument<'_, '_>,
    ) -> PyResult<bool> {
        let (t, q, v) = self.at(t, q, v)?;
        Ok(self.sim.controller_would_change(t, &q, &v))
    }

    /// Set the state to (t, q, v) and apply the event of ``guard``; None: sample the controller.
    ///
    /// Returns whether the simulation can continue. ValueError for a guard that the contact state
    /// does not have.
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

    /// Wall time of ``repeats`` repetitions of an operation [s].
    ///
    /// Each repetition works on a copy of the present simulation; copying is not timed. Operations:
    /// `rhs`, one evaluation of the accelerations in the present contact state; `step`, one time
    /// step of the scene's method, including its events; `batch`, the same for up to 64 copies in
    /// SIMD lanes.
    ///
    /// ValueError for an unknown operation, fewer than one repetition, or after termination.
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

    /// Heights above the ice (2, 2) [m]: supporting and free foot; heel and toe.
    fn gaps<'py>(&self, py: Python<'py>) -> Out2<'py> {
        ndarray::arr2(&self.sim.sole_points.gaps).into_pyarray(py)
    }

    /// Violation of the free foot's constraints [m, rad] and its rate [m/s, rad/s].
    fn violation(&self) -> (f64, f64) {
        self.sim.violation()
    }

    /// Events since the last call, at most the last 1,024, oldest first.
    ///
    /// Each is (time, description, state before, state after, supporting leg). They are those that
    /// `stats` counts, also an event after which the state is the same: a landing of an end that
    /// leaves at once. One during which the simulation ends is counted only.
    fn take_events(&mut self) -> Vec<(f64, &'static str, u8, u8, &'static str)> {
        let events = self.sim.take_events().into_iter();
        events
            .map(|e| (e.t, e.what, e.from.number(), e.to.number(), e.leg.name()))
            .collect()
    }

    /// Gait steps since the last call, at most the last 1,024; each takes at least 0.1 s.
    ///
    /// Keys: `time` of the leg swap [s], `period` [s], `slide` (displacement of the supporting foot
    /// while sliding [m]), `loaded_slide` (the same while the foot carries at least a tenth of the
    /// weight [m]), `progress` (displacement of the hips [m]), `lowest_head` [m], `deepest_toe`
    /// (lowest point of the free toe, negative below the ice [m]), `inadmissible_time` (tensile
    /// normal force, force outside the friction cone, or couple tau1 that the supporting sole
    /// cannot carry [s]).
    fn take_steps<'py>(&mut self, py: Python<'py>) -> PyResult<Vec<Bound<'py, PyDict>>> {
        tables::steps(py, &mut self.sim)
    }

    /// Counters since the reset.
    ///
    /// Keys: `steps` (time steps), `rejections`, `evaluations` of the right-hand side,
    /// `factorisations` of the implicit methods, `root_iterations`, `events`, `projections`;
    /// `error_estimate`, the sum of the estimated local errors [rad, m]; with an energy balance
    /// `energy_residual`, the unaccounted energy [J].
    fn stats<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyDict>> {
        tables::stats(py, &self.sim)
    }

    /// Totals since the reset, including the unfinished gait step.
    ///
    /// Keys: `slide` and `loaded_slide` [m] as in `take_steps`; `steps`, number of transfers of the
    /// load: the other leg supports and carries at least a tenth of the weight, at least 0.15 s
    /// after the last transfer; `flight_time` with both feet in the air and `double_support_time`
    /// with both feet on the ice [s].
    fn totals<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyDict>> {
        tables::totals(py, &self.sim)
    }

    /// Energy balance since the reset [J].
    ///
    /// Keys: `actuators` and `kicks` (work done on the robot); `damping`, `friction`, `impacts` and
    /// `capture` (slow feet that begin to stick) (dissipated).
    ///
    /// ValueError if the scene has `energy_balance = false`.
    fn energy_balance<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyDict>> {
        tables::energy_balance(py, &self.sim)
    }

    /// Check laws of mechanics from now on, as `laws` lists them; what was found is forgotten.
    ///
    /// A motion that `linearize` differentiates is not checked, nor is a copy by pickle.
    #[pyo3(signature = (on = true))]
    fn check_laws(&mut self, on: bool) {
        self.sim.check(on);
    }

    /// How the motion has kept each law since `check_laws`; empty without it.
    ///
    /// Keys: `law` and `unit`; `limit`, the amount that counts as rounding and truncation,
    /// infinite for laws that the accuracy does not keep; `largest`, the largest amount so far;
    /// `count` of breaches; `breaches`, the first eight: `time` [s], `amount`, contact `state`, and
    /// the `event` during which it happened, None within a time step.
    fn laws<'py>(&self, py: Python<'py>) -> PyResult<Vec<Bound<'py, PyDict>>> {
        tables::laws(py, &self.sim)
    }

    /// Everything needed to continue bit for bit.
    fn snapshot(&self) -> Vec<u8> {
        self.sim.snapshot()
    }

    /// Restore a snapshot of a simulator of the same scene; ValueError if it is damaged.
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

    /// M(q) of Eq. 9, (n, n).
    fn mass_matrix<'py>(&self, py: Python<'py>, q: Argument<'_, 'py>) -> PyResult<Out2<'py>> {
        let n = self.n();
        let eval = self.moved(&vector("q", q, n)?, &[0.0; NV]);
        let inertia = eval.inertias.crba(&self.sim.model, &eval.kin);
        square(py, inertia.as_slice().to_vec(), n)
    }

    /// h(q, v) + g(q) of Eq. 9, (n,); no damping.
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

    /// Kinetic and potential energy [J]; the ice is the zero of height.
    fn energy(&self, q: Argument<'_, '_>, v: Argument<'_, '_>) -> PyResult<(f64, f64)> {
        let (q, v) = (vector("q", q, self.n())?, vector("v", v, self.n())?);
        let eval = self.moved(&q, &v);
        Ok(bias_forces::energy(&self.sim.model, &eval.kin, &v, q[1]))
    }

    /// (3,): linear momentum along y and z [kg m/s], angular momentum about the world's x axis.
    ///
    /// The angular momentum [kg m2/s] is taken about the world's origin. The legs move in the
    /// sagittal plane only; the constraint reaction balances the other components.
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
