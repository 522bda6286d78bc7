"""The compiled engine. Angles in rad, lengths in m, forces in N, torques in N m, times in s.

Coordinates are those of the paper, rooted at the supporting foot: `y0, z0` the position of its toe
in every contact state, `q1` its rotation, `q2 .. q17` the joints; `n` is their number (19 when no
joint is locked). The notation page is part of the documentation of the Rust crate.

An argument of a wrong type raises TypeError. A wrong shape or value, or a number that is not
finite, raises ValueError. The message names the argument, its value and the valid values; nothing
has changed.

Long calls run the handlers of signals at least every 0.1 s, so that Ctrl-C raises
KeyboardInterrupt. `Simulator.advance` and `step` then leave the state at the end of a time step
before the end time, from which the simulation can continue; a reset leaves everything unchanged.
In `Batch.step` some environments have made their whole action, the others none. An action that has
begun is completed, which may take longer than 0.1 s in a costly scene with actions near 1 s.
"""

from typing import Any, TypeAlias, final

import numpy as np
from numpy.typing import NDArray

__all__ = [
    "EFFECTS",
    "REWARD_WEIGHTS",
    "TERMINATIONS",
    "Batch",
    "Linearization",
    "Scene",
    "Simulator",
]

_Array: TypeAlias = NDArray[np.float64]

EFFECTS: dict[str, str]
"""Effects that a scene can enable or disable: name and meaning, in the order of the tables.

Examples
--------
>>> import skate_env
>>> sorted(skate_env.EFFECTS)[:2]
['arm_swing', 'arms']
"""

REWARD_WEIGHTS: list[tuple[str, str, float]]
"""Name, unit and default value of the reward's weights, one for each term, then of its limits."""

TERMINATIONS: list[str]
"""All values of `Simulator.termination` except None."""

@final
class Scene:
    """Validated, immutable description of a simulation; compared by its fields.

    Examples
    --------
    >>> import skate_env
    >>> scene = skate_env.load_scene("paper").with_values({"ice.friction.mu_forward": 0.1})
    >>> scene.get("ice.friction.mu_forward")
    0.1
    """

    def __eq__(self, other: object, /) -> bool: ...
    def __hash__(self, /) -> int: ...
    def __reduce__(self) -> tuple[Any, tuple[str]]: ...
    @staticmethod
    def from_toml(text: str) -> Scene:
        """Parse the text of a scene file; ValueError names the field and the valid values."""
    @staticmethod
    def from_json(text: str) -> Scene:
        """Parse JSON with the fields of `to_json`; missing fields have their defaults."""
    def to_toml(self) -> str:
        """All fields, including defaults, as TOML."""
    def to_json(self) -> str:
        """All fields, including defaults, as JSON."""
    @property
    def name(self) -> str:
        """Name, a field of the scene."""
    def get(self, name: str) -> Any:
        """Return a field, or a table of fields as a dict, by its dotted name.

        None for the field of an effect that is off, so `get("control.lifting.ahead")` is None
        without lifting. ValueError lists the valid names.
        """
    # --- effects and numbers -----------------------------------------------------------------
    def effects(self) -> dict[str, bool]:
        """Name of every effect, and whether it is enabled."""
    def without(self, effect: str) -> Scene:
        """Copy the scene without an effect and without the settings that depend on it.

        ValueError for an unknown name, or if the rest of the scene requires the effect.
        """
    def with_effect(self, effect: str) -> Scene:
        """Copy the scene with an effect and its typical parameters; errors as for `without`."""
    def parameters(self) -> dict[str, tuple[float, float, float, str]]:
        """All parameters by dotted name: value, minimum, maximum, unit.

        Elements of a list count from 0, as in `control.lifting.K_p.2`.
        """
    def with_values(self, values: dict[str, float]) -> Scene:
        """Copy the scene with other parameters, named as in `parameters`.

        ValueError names the parameter that is unknown or out of range.
        """

@final
class Simulator:
    """Simulation of one robot.

    One thread at a time uses an object: a call during another one, which releases the interpreter,
    raises RuntimeError ("Already borrowed") and changes nothing.

    Examples
    --------
    >>> import skate_env
    >>> sim = skate_env.Simulator("paper")
    >>> while sim.step() and sim.time < 1.0:
    ...     pass
    >>> sim.support_leg, sim.contact_forces.shape
    ('left', (2, 4))
    """

    def __new__(cls, scene: Scene) -> Simulator: ...
    @property
    def scene(self) -> Scene:
        """Scene of the present episode, with the parameters of its reset."""
    # --- shape -----------------------------------------------------------------------------
    @property
    def coordinate_names(self) -> list[str]:
        """The n names, root first: `["y0", "z0", "q1", "q2", ...]`."""
    def size(self) -> dict[str, int]:
        """Sizes of the model.

        Keys: `dof`, coordinates that move in at least one contact state; `rows`, maximum number of
        multipliers of the free foot; `guards`, number of different guards; `accelerations` and
        `multipliers`, unknowns of Table 2 in the present contact state.
        """
    @property
    def action_period(self) -> float:
        """Duration of one `step` [s]."""
    def bodies(self) -> list[dict[str, Any]]:
        """Rigid bodies in the order of the coordinates; a locked joint merges its two bodies.

        Keys: `name`, `joint` (coordinate name; the first body carries `y0, z0, q1`), `parent`
        (index, -1 for the first), `axis` ("x", "y" or "z"), `offset` (3,) of its joint in the
        parent's frame [m], `mass` [kg], `com` (3,) in its own frame [m], `inertia` (3, 3) about
        its centre of mass in its own frame [kg m2], `damping` of its joint [N m s/rad].
        """
    # --- state -----------------------------------------------------------------------------
    @property
    def time(self) -> float:
        """Simulation time [s], 0 after a reset."""
    @property
    def q(self) -> _Array:
        """Coordinates (n,), a copy."""
    @property
    def v(self) -> _Array:
        """Velocities (n,), a copy."""
    @property
    def support_leg(self) -> str:
        """`"right"` or `"left"`."""
    @property
    def state_number(self) -> int:
        """Row of Table 2, 1 to 20; 0 in flight."""
    @property
    def state_name(self) -> str:
        """Contact state as supporting foot / free foot, for example `slide_flat/slide_heel`."""
    @property
    def termination(self) -> str | None:
        """Cause of termination, or None while the simulation can continue.

        `fall`, `jam`, `singular`, `step_limit`, `overspeed`, `not_finite` or `wedged`; see
        `docs/hard-cases.md`. In environments also `no_step`: no step for too long.
        """
    @property
    def torque(self) -> _Array:
        """Generalised torque at the present instant (n,): baseline plus residual."""
    @property
    def acceleration(self) -> _Array:
        """Accelerations at the present instant (n,)."""
    @property
    def contact_forces(self) -> _Array:
        """(2, 4) [N]: rows supporting, free foot; columns f_y, N, N at the heel, N at the toe."""
    @property
    def head_position(self) -> _Array:
        """Top of the head in the world (3,) [m]."""
    def observation(self) -> NDArray[np.float32]:
        """Observation of the present state (d,), as an environment on the same scene returns it.

        `IceSkateEnv.observation_names` lists the entries.
        """
    def link_segments(self, q: _Array | None = None) -> _Array:
        """(17, 2, 3) [m]: both ends of every link of Table 1 in the world, in the paper's order.

        The segment of a foot is its sole, heel to toe. `q=None` means the present state.
        """
    def reset(
        self,
        q: _Array | None = None,
        v: _Array | None = None,
        support_leg: str | None = None,
        params: dict[str, float] | None = None,
    ) -> None:
        """Reset to the scene's start, or to the given state, at t = 0.

        `q`, `v` and `support_leg` of any simulation of the scene give that state bit for bit. The
        controller starts anew: other torques may open a contact at once. A state in single
        precision is projected onto the ice, by micrometres and micrometres per second.

        `params` replaces parameters for this episode, named as in `Scene.parameters`: friction,
        masses, lengths, gains, gravity. The next reset uses the scene's own values again.

        ValueError, with nothing changed, if the state is not finite, has the wrong shape or is
        below the ice, or if a parameter is unknown or out of range.
        """
    def step(self, residual_torque: _Array | None = None) -> bool:
        """Advance one action period with a constant residual (16 or n - 3 joint torques) [N m].

        Returns True while the simulation can continue; otherwise `termination` is the cause.
        """
    def perturb(self, sigma: float, seed: int) -> None:
        """Reset to the scene's start with a random disturbance; the support stays flat.

        Normal noise is added to the leg angles q2 .. q7 (``sigma`` rad) and to their rates
        (``sigma`` rad/s), and the skating speed is multiplied by ``1 + sigma * n``. A draw
        with the free foot below the ice is repeated, up to 100 times.

        ValueError, with nothing changed, if ``sigma`` is outside [0, 10] or no draw is valid.
        """
    def kick(self, speed: float) -> bool:
        """Add ``speed`` [m/s], -10 to 10, to the forward velocity of every body instantaneously.

        Joint rates do not change; feet on the ice slide in their new direction. No effect after
        termination. Returns whether the simulation can continue.

        ValueError, with nothing changed, if ``speed`` is out of range, or not 0 on sticking ice.
        """
    # --- advancing and results ---------------------------------------------------------------
    def advance(self, until: float, residual_torque: _Array | None = None) -> bool:
        """Advance to the time ``until`` [s] with a constant residual torque (n - 3,) [N m].

        Returns whether the simulation can continue. ValueError for a time in the past. After
        KeyboardInterrupt `time` is the end of the last time step, before ``until``.
        """
    # --- derivatives; see docs/gradients.md ----------------------------------------------------
    def linearize(
        self,
        residual_torque: _Array | None = None,
        until: float | None = None,
        params: list[str] | None = None,
    ) -> Linearization:
        """Differentiate the motion to the time ``until`` [s]; the simulator does not change.

        Parameters
        ----------
        residual_torque
            Torque that is held (n - 3,) [N m]; None for zero.
        until
            End of the motion [s]; None for the end of the action period.
        params
            Parameters to differentiate by, named as in `Scene.parameters`.

        Raises
        ------
        ValueError
            For rosenbrock, a time in the past, a parameter that is unknown, repeated, or selects
            start, accuracy or sample times, any parameter with time stepping (`fast`), or a motion
            that terminates or is stiff.
        """
    def state_vector(self) -> _Array:
        """Differentiated state (2 n + 4,): q, v, anchor of the free foot, times t0, t1, t2."""
    def displace(self, dx: _Array) -> bool:
        """Add ``dx`` (2 n + 4,) to the state and project it onto the mode's constraints.

        Contact state and time do not change. Returns whether the simulation can continue.
        ValueError where an entry of the state leaves [-1e6, 1e6]; then nothing has changed.
        """
    # --- hybrid system for external integrators: right-hand side, guards, reset map -----------
    def rhs(self, t: float, q: _Array, v: _Array) -> _Array:
        """Accelerations (n,) in the present contact state with the present controller state.

        ValueError if the contact forces have no solution.
        """
    def guards(self, t: float, q: _Array, v: _Array) -> dict[str, float]:
        """Guards of the present contact state; an event occurs when one decreases through zero.

        Exception: ``free toe lands`` also fires when it increases through zero, in two-way contact
        without contact of the toe alone.
        """
    def sampled(self, t: float, q: _Array, v: _Array) -> bool:
        """Whether a controller sample at this state would change the controller state."""
    def reset_map(self, t: float, q: _Array, v: _Array, guard: str | None = None) -> bool:
        """Set the state to (t, q, v) and apply the event of ``guard``; None: sample the controller.

        Returns whether the simulation can continue. ValueError for a guard that the contact state
        does not have.
        """
    def measure(self, work: str, repeats: int) -> float:
        """Wall time of ``repeats`` repetitions of an operation [s].

        Each repetition works on a copy of the present simulation; copying is not timed. Operations:
        `rhs`, one evaluation of the accelerations in the present contact state; `step`, one time
        step of the scene's method, including its events; `batch`, the same for up to 64 copies in
        SIMD lanes.

        ValueError for an unknown operation, fewer than one repetition, or after termination.
        """
    def gaps(self) -> _Array:
        """Heights above the ice (2, 2) [m]: supporting and free foot; heel and toe."""
    def violation(self) -> tuple[float, float]:
        """Violation of the free foot's constraints [m, rad] and its rate [m/s, rad/s]."""
    def check_laws(self, on: bool = True) -> None:
        """Check laws of mechanics from now on, as `laws` lists them; what was found is forgotten.

        A motion that `linearize` differentiates is not checked, nor is a copy by pickle.
        """
    def laws(self) -> list[dict[str, Any]]:
        """How the motion has kept each law since `check_laws`; empty without it.

        Keys: `law` and `unit`; `limit`, the amount that counts as rounding and truncation,
        infinite for laws that the accuracy does not keep; `largest`, the largest amount so far;
        `count` of breaches; `breaches`, the first eight: `time` [s], `amount`, contact `state`, and
        the `event` during which it happened, None within a time step.
        """
    def take_events(self) -> list[tuple[float, str, int, int, str]]:
        """Events since the last call, at most the last 1,024, oldest first.

        Each is (time, description, state before, state after, supporting leg). They are those that
        `stats` counts, also an event after which the state is the same: a landing of an end that
        leaves at once. One during which the simulation ends is counted only.
        """
    def take_steps(self) -> list[dict[str, float]]:
        """Gait steps since the last call, at most the last 1,024; each takes at least 0.1 s.

        Keys: `time` of the leg swap [s], `period` [s], `slide` (displacement of the supporting foot
        while sliding [m]), `loaded_slide` (the same while the foot carries at least a tenth of the
        weight [m]), `progress` (displacement of the hips [m]), `lowest_head` [m], `deepest_toe`
        (lowest point of the free toe, negative below the ice [m]), `inadmissible_time` (tensile
        normal force, force outside the friction cone, or couple tau1 that the supporting sole
        cannot carry [s]).
        """
    def totals(self) -> dict[str, float]:
        """Totals since the reset, including the unfinished gait step.

        Keys: `slide` and `loaded_slide` [m] as in `take_steps`; `steps`, number of transfers of the
        load: the other leg supports and carries at least a tenth of the weight, at least 0.15 s
        after the last transfer; `flight_time` with both feet in the air and `double_support_time`
        with both feet on the ice [s].
        """
    def stats(self) -> dict[str, float]:
        """Counters since the reset.

        Keys: `steps` (time steps), `rejections`, `evaluations` of the right-hand side,
        `factorisations` of the implicit methods, `root_iterations`, `events`, `projections`;
        `error_estimate`, the sum of the estimated local errors [rad, m]; with an energy balance
        `energy_residual`, the unaccounted energy [J].
        """
    def energy_balance(self) -> dict[str, float]:
        """Energy balance since the reset [J].

        Keys: `actuators` and `kicks` (work done on the robot); `damping`, `friction`, `impacts` and
        `capture` (slow feet that begin to stick) (dissipated).

        ValueError if the scene has `energy_balance = false`.
        """
    def snapshot(self) -> bytes:
        """Everything needed to continue bit for bit."""
    def restore(self, data: bytes) -> None:
        """Restore a snapshot of a simulator of the same scene; ValueError if it is damaged."""
    # A pickle or a copy has the contents of a snapshot; it excludes untaken events and steps.
    def __getnewargs__(self) -> tuple[Scene]: ...
    def __getstate__(self) -> bytes: ...
    def __setstate__(self, data: bytes) -> None: ...
    # --- dynamics at any state ---------------------------------------------------------------
    def mass_matrix(self, q: _Array) -> _Array:
        """M(q) of Eq. 9, (n, n)."""
    def bias_forces(self, q: _Array, v: _Array) -> _Array:
        """h(q, v) + g(q) of Eq. 9, (n,); no damping."""
    def energy(self, q: _Array, v: _Array) -> tuple[float, float]:
        """Kinetic and potential energy [J]; the ice is the zero of height."""
    def momentum(self, q: _Array, v: _Array) -> _Array:
        """(3,): linear momentum along y and z [kg m/s], angular momentum about the world's x axis.

        The angular momentum [kg m2/s] is taken about the world's origin. The legs move in the
        sagittal plane only; the constraint reaction balances the other components.
        """

@final
class Linearization:
    """Derivatives of a motion, from `Simulator.linearize`.

    The state has s = 2 n + 4 entries, see `Simulator.state_vector`.

    Examples
    --------
    >>> import skate_env
    >>> lin = skate_env.Simulator("paper_arms").linearize(until=0.3)
    >>> lin.A.shape, lin.B.shape, lin.nonsmooth
    ((42, 42), (42, 16), [])
    """

    @property
    def time(self) -> tuple[float, float]:
        """Start and end of the motion [s]."""
    @property
    def A(self) -> _Array:
        """Final state by start state (s, s).

        A start state off the constraints is projected first, as by `Simulator.displace`.
        """
    @property
    def B(self) -> _Array:
        """Final state by held residual torque (s, n - 3)."""
    @property
    def P(self) -> _Array:
        """Final state by the parameters (s, number of parameters)."""
    @property
    def tangent_before(self) -> _Array:
        """Orthonormal basis of the constraints' tangent space at the start, by column."""
    @property
    def tangent_after(self) -> _Array:
        """The same at the end."""
    @property
    def events(self) -> list[dict[str, Any]]:
        """Events in order; those of one instant are one.

        Keys: `time` [s]; `guards`, their descriptions; `state_before`, `state_after`, rows of
        Table 2; `support_leg` after it; `guard_rate` of the first guard [unit/s], None at a fixed
        time; `saltation` (s, s); `dt_dx`, `dt_du`, `dt_dp`, derivatives of the time.
        """
    @property
    def nonsmooth(self) -> list[tuple[str, float, float]]:
        """Reason, time [s] and margin where the derivative may not exist; empty if it does."""

@final
class Batch:
    """Vector of ``IceSkate-v0`` episodes; `skate_env.vector` wraps it as a vector environment.

    Environments are numbered from 0; ValueError for an index out of range. ``docs/iceskate-v0.md``
    lists the keys of infos.

    Parameters
    ----------
    scene, n
        Scene and number of the episodes; all must be reset before the first step.
    action_scale
        Residual torque of a full action, one value per joint of the scene [N m].
    joints
        Joints of an action, in its order.
    mirrored
        Whether states with left support are shown and acted on as in a mirror.
    reward
        Weights and limits by name that replace those of `REWARD_WEIGHTS`.
    torque_limit
        Limit on a joint's total torque due to an action [N m]; the baseline's may exceed it.
    perturb
        Disturbance of every start, as for `Simulator.perturb`, 0 to 10.
    trunk_noise
        Normal noise on angles [rad] and rates [rad/s] of q8 and q10 at every start, 0 to 1;
        must be 0 if the scene locks both.
    kick
        Speed of random kicks, 2 to 6 s apart [m/s], 0 to 10; must be 0 on sticking ice.
    limit
        Number of actions after which an episode is truncated; None for no limit.
    autoreset
        ``"NextStep"``, ``"SameStep"`` or ``"Disabled"``.
    threads
        Maximum number of threads; None for one per core. A process has one thread pool.
    """

    def __new__(
        cls,
        scene: Scene,
        n: int,
        *,
        action_scale: list[float],
        joints: list[str],
        mirrored: bool,
        reward: dict[str, float],
        torque_limit: float,
        perturb: float,
        trunk_noise: float,
        kick: float,
        limit: int | None,
        autoreset: str,
        threads: int | None,
    ) -> Batch: ...
    @property
    def joint_names(self) -> list[str]:
        """Names of the joints, in the order of an action."""
    @property
    def action_period(self) -> float:
        """Duration of an action [s]."""
    @property
    def lanes(self) -> int:
        """Environments per SIMD register with fixed time steps: 1, 2, 4 or 8.

        The default is the maximum of the processor. A smaller value is slower and gives the same
        results; ValueError for a value that the processor does not support.
        """
    @lanes.setter
    def lanes(self, lanes: int) -> None: ...
    def observation_entries(self) -> list[tuple[str, str, str, float, float]]:
        """Name, meaning, unit, minimum and maximum of every entry of an observation."""
    def reset(
        self,
        which: list[int],
        seeds: list[int | None],
        elapsed: list[int],
        *,
        q: _Array | None = None,
        v: _Array | None = None,
        support_leg: str | None = None,
        params: dict[str, float] | None = None,
        phase: float | None = None,
        perturb: float | None = None,
    ) -> None:
        """Reset the environments ``which``; None stands for the scene's own value.

        Parameters
        ----------
        seeds
            Seeds of the random numbers; None continues the present sequence.
        elapsed
            Number of actions that count as done with respect to the limit.
        q, v, support_leg
            Start state; it is disturbed only if ``perturb`` is given.
        params
            Parameters of these episodes, as for `Simulator.reset`; they override drawn ones.
        phase
            Gait steps of the baseline before the episode, including a fraction of the last one.

        Raises
        ------
        ValueError
            If a start is not valid; nothing has changed.
        """
    def is_seeded(self, i: int) -> bool:
        """Whether environment ``i`` has been given a seed."""
    def waiting(self) -> tuple[int, bool] | None:
        """Return the first environment that needs a reset, and whether its episode has ended."""
    def observe(self) -> NDArray[np.float32]:
        """Observations of the present states (n, d)."""
    def info(self, i: int) -> dict[str, float | int | str | None]:
        """Info of environment ``i`` after the last step or reset."""
    def infos_each(self) -> list[dict[str, Any]]:
        """Infos of all environments after a step, one dict each, as in Stable-Baselines3.

        They include ``TimeLimit.truncated``. Environments that the step has reset have the final
        info and ``terminal_observation``.
        """
    def infos(self, which: list[int] | None = None) -> dict[str, Any]:
        """Infos in Gymnasium's form: an array per key and a mask ``_key``.

        With ``which``: infos of these environments, zeros and None for the others. Without: infos
        of all after a step, with ``final_obs`` and ``final_info`` of those that it has reset.
        """
    def step(
        self, actions: Any
    ) -> tuple[
        NDArray[np.float32],
        _Array,
        NDArray[np.bool_],
        NDArray[np.bool_],
    ]:
        """Apply actions (n, joints) for one period.

        Returns observations (n, d), rewards, terminated, truncated (n,).

        TypeError if actions are not real numbers; ValueError for a wrong shape, a number that is
        not finite, or an environment that needs a reset.
        """
    def step_alone(
        self, action: Any
    ) -> tuple[NDArray[np.float32], float, bool, dict[str, float | int | str | None]]:
        """Apply an action (joints,) for one period; for a batch of one environment.

        Returns observation (d,), reward, terminated and `info`. Errors as for `step`.
        """
    def states(self) -> _Array:
        """State of each environment (n, z), see `IceSkateVectorEnv.state_vectors`."""
    def step_differentiated(
        self, actions: NDArray[Any]
    ) -> tuple[
        tuple[NDArray[np.float32], _Array, NDArray[np.bool_], NDArray[np.bool_]], dict[str, Any]
    ]:
        """Make a `step` with the fields of `skate_env.gradients.StepDerivatives` by name.

        ValueError also with a limit of the torques, kicks, or an accuracy without derivatives.
        """
    def check_laws(self, on: bool = True) -> None:
        """Check the laws of `Simulator.laws` in every environment; resets keep what was found."""
    def simulator(self, i: int) -> Simulator:
        """Copy of the simulator of environment ``i``, including events and the check of laws."""
    def snapshot(self, i: int) -> bytes:
        """Everything that environment ``i`` needs to continue bit for bit, with random state."""
    def restore(self, i: int, data: bytes) -> None:
        """Restore environment ``i`` from a snapshot of the same scene; ValueError if damaged."""
