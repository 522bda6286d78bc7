//! `Batch`: vector of `IceSkate-v0` episodes.

use crate::{
    action_derivatives::stacked,
    arrays::{
        Argument, bytes, integer, leg, number, numbers, reals, text, type_error, value_error,
        vector,
    },
    infos,
    scene::Scene,
    signals::interruptible,
    simulator::Simulator,
};
use numpy::{PyArray1, PyArray2, PyArrayMethods};
use pyo3::{
    exceptions::PyValueError,
    prelude::*,
    types::{PyBytes, PyDict, PyList},
};
use skate_core::{
    batch::{self, Autoreset, Outcome},
    derivatives::state_size,
    error::Termination,
    numeric::{simd::Width, stack::with_stack},
    task::{self, EpisodeStatus, MEMORY, Start, Task, WEIGHTS, Weights},
};

/// Vector of ``IceSkate-v0`` episodes; `skate_env.vector` wraps it as a vector environment.
///
/// Environments are numbered from 0; ValueError for an index out of range. ``docs/iceskate-v0.md``
/// lists the keys of infos.
///
/// Parameters
/// ----------
/// scene, n
///     Scene and number of the episodes; all must be reset before the first step.
/// action_scale
///     Residual torque of a full action, one value per joint of the scene [N m].
/// joints
///     Joints of an action, in its order.
/// mirrored
///     Whether states with left support are shown and acted on as in a mirror.
/// reward
///     Weights and limits by name that replace those of `REWARD_WEIGHTS`.
/// torque_limit
///     Limit on a joint's total torque due to an action [N m]; the baseline's may exceed it.
/// perturb
///     Disturbance of every start, as for `Simulator.perturb`, 0 to 10.
/// trunk_noise
///     Normal noise on angles [rad] and rates [rad/s] of q8 and q10 at every start, 0 to 1;
///     must be 0 if the scene locks both.
/// kick
///     Speed of random kicks, 2 to 6 s apart [m/s], 0 to 10; must be 0 on sticking ice.
/// limit
///     Number of actions after which an episode is truncated; None for no limit.
/// autoreset
///     ``"NextStep"``, ``"SameStep"`` or ``"Disabled"``.
/// threads
///     Maximum number of threads; None for one per core. A process has one thread pool.
#[pyclass(module = "skate_env._core")]
pub struct Batch {
    inner: batch::Batch,
    /// Outcomes of the last step.
    outcomes: Vec<Outcome>,
}

/// Maximum number of environments, threads or actions.
const MAX_COUNT: u64 = i64::MAX as u64;

type Observations<'py> = Bound<'py, PyArray2<f32>>;
type Column<'py, T> = Bound<'py, PyArray1<T>>;
type Stepped<'py> = (
    Observations<'py>,
    Column<'py, f64>,
    Column<'py, bool>,
    Column<'py, bool>,
);

type Made<'py> = (Column<'py, f32>, f64, bool, Bound<'py, PyDict>);

impl Batch {
    fn index(&self, given: Argument<'_, '_>) -> PyResult<usize> {
        let last = self.inner.episodes.len() - 1;
        Ok(integer("environment", given, 0, last as u64)? as usize)
    }

    /// Check that all environments can step.
    fn check_waiting(&self) -> PyResult<()> {
        match self.inner.waiting() {
            Some((i, _)) => {
                let message = format!("environment {i} waits for a reset");
                Err(PyValueError::new_err(message))
            }
            None => Ok(()),
        }
    }

    /// Observations, and the other results of the last step.
    fn stepped<'py>(&self, py: Python<'py>, observations: Observations<'py>) -> Stepped<'py> {
        let rows = || self.outcomes.iter().map(|(row, _)| row);
        (
            observations,
            PyArray1::from_iter(py, rows().map(|row| row.reward)),
            PyArray1::from_iter(py, rows().map(|row| row.terminated)),
            PyArray1::from_iter(py, rows().map(|row| row.truncated)),
        )
    }

    /// Step all environments, or some of them if a signal interrupts.
    fn step_all(&mut self, py: Python<'_>, actions: &[f64], seen: &mut [f32]) -> PyResult<()> {
        self.check_waiting()?;
        let (inner, outcomes) = (&mut self.inner, &mut self.outcomes);
        interruptible(py, |go_on| inner.step(actions, seen, outcomes, go_on))?.map_err(value_error)
    }
}

#[pymethods]
impl Batch {
    #[new]
    #[pyo3(signature = (scene, n, *, action_scale, joints, mirrored, reward, torque_limit, perturb, trunk_noise, kick, limit, autoreset, threads))]
    #[allow(clippy::too_many_arguments)]
    fn new(
        scene: Argument<'_, '_>,
        n: Argument<'_, '_>,
        action_scale: Vec<Bound<'_, PyAny>>,
        joints: Vec<String>,
        mirrored: bool,
        reward: Argument<'_, '_>,
        torque_limit: Argument<'_, '_>,
        perturb: Argument<'_, '_>,
        trunk_noise: Argument<'_, '_>,
        kick: Argument<'_, '_>,
        limit: Option<Argument<'_, '_>>,
        autoreset: Argument<'_, '_>,
        threads: Option<Argument<'_, '_>>,
    ) -> PyResult<Self> {
        let count = |name, given: Argument<'_, '_>| integer(name, given, 1, MAX_COUNT);
        let n = count("num_envs", n)? as usize;
        let limit = limit
            .map(|limit| count("max_episode_steps", limit))
            .transpose()?;
        let threads = threads
            .map(|threads| count("num_threads", threads))
            .transpose()?;
        let threads = threads.map(|threads| threads as usize);
        let given = scene;
        let scene = given.cast::<Scene>();
        let scene = scene
            .map_err(|_| type_error("scene", given, "a Scene"))?
            .get();
        let autoreset = match text("autoreset", autoreset)?.as_str() {
            "NextStep" => Autoreset::NextStep,
            "SameStep" => Autoreset::SameStep,
            "Disabled" => Autoreset::Disabled,
            other => {
                let known = "\"NextStep\", \"SameStep\" or \"Disabled\"";
                let message = format!("autoreset = \"{other}\": must be {known}");
                return Err(PyValueError::new_err(message));
            }
        };
        let weights = Weights::with(&numbers("reward", reward)?).map_err(value_error)?;
        let torque_limit = number("torque_limit", torque_limit)?;
        let scales = action_scale.iter().map(|x| number("action_scale", x));
        let action_scale = scales.collect::<PyResult<_>>()?;
        let task = Task::new(scene.inner.clone(), action_scale, weights)
            .and_then(|task| task.with_joints(&joints))
            .and_then(|task| {
                if mirrored {
                    task.with_mirror()
                } else {
                    Ok(task)
                }
            })
            .map_err(value_error)?;
        if torque_limit.is_nan() || torque_limit < 0.0 {
            let message = format!("torque_limit = {torque_limit}: must be at least 0 N m");
            return Err(PyValueError::new_err(message));
        }
        let task = Task {
            torque_limit,
            perturb: number("perturb", perturb)?,
            trunk_noise: number("trunk_noise", trunk_noise)?,
            kick: number("kick", kick)?,
            limit,
            ..task
        };
        let inner = with_stack(|| batch::Batch::new(task, n, autoreset, threads));
        let inner = inner.map_err(value_error)?;
        let outcomes = inner.episodes.iter().map(|e| (e.result(), None)).collect();
        Ok(Self { inner, outcomes })
    }

    /// Names of the joints, in the order of an action.
    #[getter]
    fn joint_names(&self) -> Vec<&'static str> {
        self.inner.task.joint_names()
    }

    /// Duration of an action [s].
    #[getter]
    fn action_period(&self) -> f64 {
        self.inner.task.action_period()
    }

    /// Environments per SIMD register with fixed time steps: 1, 2, 4 or 8.
    ///
    /// The default is the maximum of the processor. A smaller value is slower and gives the same
    /// results; ValueError for a value that the processor does not support.
    #[getter]
    fn lanes(&self) -> usize {
        self.inner.lanes.lanes()
    }

    #[setter]
    fn set_lanes(&mut self, lanes: Argument<'_, '_>) -> PyResult<()> {
        let lanes = integer("lanes", lanes, 0, MAX_COUNT)? as usize;
        self.inner.lanes = Width::of(lanes).ok_or_else(|| {
            let here: Vec<String> = Width::all().map(|w| w.lanes().to_string()).collect();
            let here = here.join(" or ");
            PyValueError::new_err(format!("lanes = {lanes}: must be {here} on this processor"))
        })?;
        Ok(())
    }

    /// Name, meaning, unit, minimum and maximum of every entry of an observation.
    fn observation_entries(&self) -> Vec<(String, String, &'static str, f32, f32)> {
        let entries = self.inner.task.observation.iter().cloned();
        entries
            .map(|e| (e.name, e.meaning, e.unit, e.low, e.high))
            .collect()
    }

    /// Reset the environments ``which``; None stands for the scene's own value.
    ///
    /// Parameters
    /// ----------
    /// seeds
    ///     Seeds of the random numbers; None continues the present sequence.
    /// elapsed
    ///     Number of actions that count as done with respect to the limit.
    /// q, v, support_leg
    ///     Start state; it is disturbed only if ``perturb`` is given.
    /// params
    ///     Parameters of these episodes, as for `Simulator.reset`; they override drawn ones.
    /// phase
    ///     Gait steps of the baseline before the episode, including a fraction of the last one.
    ///
    /// Raises
    /// ------
    /// ValueError
    ///     If a start is not valid; nothing has changed.
    #[pyo3(signature = (which, seeds, elapsed, *, q = None, v = None, support_leg = None, params = None, phase = None, perturb = None))]
    #[allow(clippy::too_many_arguments)]
    fn reset(
        &mut self,
        py: Python<'_>,
        which: Vec<Bound<'_, PyAny>>,
        seeds: Vec<Option<Bound<'_, PyAny>>>,
        elapsed: Vec<Bound<'_, PyAny>>,
        q: Option<Argument<'_, '_>>,
        v: Option<Argument<'_, '_>>,
        support_leg: Option<Argument<'_, '_>>,
        params: Option<Argument<'_, '_>>,
        phase: Option<Argument<'_, '_>>,
        perturb: Option<Argument<'_, '_>>,
    ) -> PyResult<()> {
        let which: Vec<usize> = which
            .iter()
            .map(|i| self.index(i))
            .collect::<PyResult<_>>()?;
        if (seeds.len(), elapsed.len()) != (which.len(), which.len()) {
            let message = format!(
                "{} seeds and {} elapsed: must be {} each",
                seeds.len(),
                elapsed.len(),
                which.len()
            );
            return Err(PyValueError::new_err(message));
        }
        let seed_of = |given: Option<_>| given.map(|seed| integer("seed", &seed, 0, u64::MAX));
        let seeds: Vec<Option<u64>> = seeds
            .into_iter()
            .map(|given| seed_of(given).transpose())
            .collect::<PyResult<_>>()?;
        let elapsed = elapsed.iter().map(|x| integer("elapsed", x, 0, u64::MAX));
        let elapsed: Vec<u64> = elapsed.collect::<PyResult<_>>()?;
        let n = self.inner.episodes[0].sim.model.n;
        let state = task::StateOverride {
            q: q.map(|q| vector("q", q, n)).transpose()?,
            v: v.map(|v| vector("v", v, n)).transpose()?,
            leg: support_leg.map(leg).transpose()?,
        };
        let perturb = perturb.map(|x| number("perturb", x)).transpose()?;
        let phase = phase.map(|x| number("phase", x)).transpose()?;
        let params = params.map(|params| numbers("params", params)).transpose()?;
        let start = Start {
            state,
            params: params.unwrap_or_default(),
            phase: phase.unwrap_or(0.0),
            perturb,
            ..Start::default()
        };
        let of = |((i, seed), elapsed)| {
            let start = start.clone();
            (
                i,
                Start {
                    seed,
                    elapsed,
                    ..start
                },
            )
        };
        let starts: Vec<_> = which.into_iter().zip(seeds).zip(elapsed).map(of).collect();
        let inner = &mut self.inner;
        interruptible(py, |go_on| inner.reset(&starts, go_on))?.map_err(value_error)?;
        for (i, _) in starts {
            self.outcomes[i] = (self.inner.episodes[i].result(), None);
        }
        Ok(())
    }

    /// Whether environment ``i`` has been given a seed.
    fn is_seeded(&self, i: Argument<'_, '_>) -> PyResult<bool> {
        Ok(self.inner.episodes[self.index(i)?].is_seeded())
    }

    /// Return the first environment that needs a reset, and whether its episode has ended.
    fn waiting(&self) -> Option<(usize, bool)> {
        let (i, status) = self.inner.waiting()?;
        Some((i, status == EpisodeStatus::Over))
    }

    /// Observations of the present states (n, d).
    fn observe<'py>(&self, py: Python<'py>) -> PyResult<Observations<'py>> {
        let (episodes, task) = (&self.inner.episodes, &self.inner.task);
        let width = task.observation.len();
        let out = PyArray2::zeros(py, [episodes.len(), width], false);
        let mut view = out.try_readwrite()?;
        for (episode, row) in episodes.iter().zip(view.as_slice_mut()?.chunks_mut(width)) {
            episode.observe(task, row);
        }
        drop(view);
        Ok(out)
    }

    /// Info of environment ``i`` after the last step or reset.
    fn info<'py>(&self, py: Python<'py>, i: Argument<'_, '_>) -> PyResult<Bound<'py, PyDict>> {
        infos::single(py, &self.outcomes[self.index(i)?].0.info)
    }

    /// Infos of all environments after a step, one dict each, as in Stable-Baselines3.
    ///
    /// They include ``TimeLimit.truncated``. Environments that the step has reset have the final
    /// info and ``terminal_observation``.
    fn infos_each<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyList>> {
        infos::each(py, &self.outcomes)
    }

    /// Infos in Gymnasium's form: an array per key and a mask ``_key``.
    ///
    /// With ``which``: infos of these environments, zeros and None for the others. Without: infos
    /// of all after a step, with ``final_obs`` and ``final_info`` of those that it has reset.
    #[pyo3(signature = (which = None))]
    fn infos<'py>(
        &self,
        py: Python<'py>,
        which: Option<Vec<Bound<'py, PyAny>>>,
    ) -> PyResult<Bound<'py, PyDict>> {
        let Some(which) = which else {
            return infos::of_step(py, &self.outcomes);
        };
        let which: PyResult<Vec<usize>> = which.iter().map(|i| self.index(i)).collect();
        let now = |i: usize| &self.outcomes[i].0.info;
        infos::many(py, self.outcomes.len(), Some(&which?), now)
    }

    /// Apply actions (n, joints) for one period.
    ///
    /// Returns observations (n, d), rewards, terminated, truncated (n,).
    ///
    /// TypeError if actions are not real numbers; ValueError for a wrong shape, a number that is
    /// not finite, or an environment that needs a reset.
    fn step<'py>(&mut self, py: Python<'py>, actions: Argument<'_, 'py>) -> PyResult<Stepped<'py>> {
        let (n, joints) = (self.inner.episodes.len(), self.inner.task.joints());
        let actions = reals("actions", actions, &[n, joints])?;
        let observations = PyArray2::zeros(py, [n, self.inner.task.observation.len()], false);
        self.step_all(py, &actions, observations.try_readwrite()?.as_slice_mut()?)?;
        Ok(self.stepped(py, observations))
    }

    /// Apply an action (joints,) for one period; for a batch of one environment.
    ///
    /// Returns observation (d,), reward, terminated and `info`. Errors as for `step`.
    fn step_alone<'py>(
        &mut self,
        py: Python<'py>,
        action: Argument<'_, 'py>,
    ) -> PyResult<Made<'py>> {
        if self.inner.episodes.len() != 1 {
            let message = format!("{} environments: must be 1", self.inner.episodes.len());
            return Err(PyValueError::new_err(message));
        }
        let action = reals("action", action, &[self.inner.task.joints()])?;
        let observation = PyArray1::zeros(py, self.inner.task.observation.len(), false);
        self.step_all(py, &action, observation.try_readwrite()?.as_slice_mut()?)?;
        let (row, _) = &self.outcomes[0];
        let info = infos::single(py, &row.info)?;
        Ok((observation, row.reward, row.terminated, info))
    }

    /// State of each environment (n, z), see `IceSkateVectorEnv.state_vectors`.
    fn states<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyArray2<f64>>> {
        let rows: Vec<_> = self
            .inner
            .episodes
            .iter()
            .map(|e| e.state_vector())
            .collect();
        Ok(PyArray2::from_vec2(py, &rows)?)
    }

    /// Make a `step` with the fields of `skate_env.gradients.StepDerivatives` by name.
    ///
    /// ValueError also with a limit of the torques, kicks, or an accuracy without derivatives.
    fn step_differentiated<'py>(
        &mut self,
        py: Python<'py>,
        actions: Argument<'_, 'py>,
    ) -> PyResult<(Stepped<'py>, Bound<'py, PyDict>)> {
        self.check_waiting()?;
        let (n, joints) = (self.inner.episodes.len(), self.inner.task.joints());
        let actions = reals("actions", actions, &[n, joints])?;
        let width = self.inner.task.observation.len();
        let observations = PyArray2::zeros(py, [n, width], false);
        let mut seen = observations.try_readwrite()?;
        let (seen, inner, outcomes) = (seen.as_slice_mut()?, &mut self.inner, &mut self.outcomes);
        let all = interruptible(py, |go_on| {
            inner.step_differentiated(&actions, seen, outcomes, go_on)
        })?;
        let state = state_size(self.inner.episodes[0].sim.model.n) + MEMORY;
        let by = stacked(py, &all.map_err(value_error)?, (state, joints, width))?;
        Ok((self.stepped(py, observations), by))
    }

    /// Copy of the simulator of environment ``i``, including events and the check of laws.
    fn simulator(&self, i: Argument<'_, '_>) -> PyResult<Simulator> {
        let episode = &self.inner.episodes[self.index(i)?];
        let sim = with_stack(|| Box::new(episode.sim.clone()));
        Ok(Simulator::around(sim, self.inner.task.scene().clone()))
    }

    /// Check the laws of `Simulator.laws` in every environment; resets keep what was found.
    #[pyo3(signature = (on = true))]
    fn check_laws(&mut self, on: bool) {
        let episodes = self.inner.episodes.iter_mut();
        episodes.for_each(|episode| episode.sim.check(on));
    }

    /// Everything that environment ``i`` needs to continue bit for bit, with random state.
    fn snapshot<'py>(&self, py: Python<'py>, i: Argument<'_, '_>) -> PyResult<Bound<'py, PyBytes>> {
        let bytes = self.inner.episodes[self.index(i)?].snapshot();
        Ok(PyBytes::new(py, &bytes))
    }

    /// Restore environment ``i`` from a snapshot of the same scene; ValueError if damaged.
    fn restore(&mut self, i: Argument<'_, '_>, data: Argument<'_, '_>) -> PyResult<()> {
        let i = self.index(i)?;
        let data = bytes("data", data)?;
        with_stack(|| self.inner.restore(i, data)).map_err(value_error)?;
        self.outcomes[i] = (self.inner.episodes[i].result(), None);
        Ok(())
    }
}

/// Names of the terminations, in the order of the info key `termination`.
pub fn termination_names() -> Vec<&'static str> {
    Termination::ALL.iter().map(|end| end.name()).collect()
}

/// Names, units and default values of the reward's weights and limits.
pub fn reward_weights() -> Vec<(&'static str, &'static str, f64)> {
    WEIGHTS.to_vec()
}
