"""The compiled engine. Angles in rad, lengths in m, forces in N, torques in N m, times in s.

Coordinates are those of the paper, rooted at the supporting foot: `y0, z0` the pivot of that foot
on the ice, `q1` the foot's rotation about it, `q2 .. q17` the joints; `n` is their number (19
when no joint is locked). `docs` of the Rust crate hold the notation page.

An argument of a wrong type raises TypeError; one of a wrong shape or value, or one that is not
finite, ValueError. The message names the argument, what it is and what it must be, and nothing has
changed.
"""

from typing import Any, TypeAlias, final

import numpy as np
from numpy.typing import NDArray

__all__ = ["EFFECTS", "TERMINATIONS", "Batch", "Scene", "Simulator"]

_Array: TypeAlias = NDArray[np.float64]

EFFECTS: dict[str, str]
"""What a scene may leave out or add: name and meaning, in the order of the scene's tables."""

TERMINATIONS: list[str]
"""Every name that `Simulator.termination` may have."""

@final
class Scene:
    """A validated description of everything a simulation needs: immutable, equal by its fields."""

    def __eq__(self, other: object, /) -> bool: ...
    def __hash__(self, /) -> int: ...
    def __reduce__(self) -> tuple[Any, tuple[str]]: ...
    @staticmethod
    def from_toml(text: str) -> Scene:
        """Parse a scene file's text; ValueError names the field and what is allowed."""
    @staticmethod
    def from_json(text: str) -> Scene:
        """Parse the output of `to_json`, or the same fields written by hand."""
    def to_toml(self) -> str:
        """Every field, defaults filled in, as TOML."""
    def to_json(self) -> str:
        """Every field, defaults filled in, as JSON."""
    @property
    def name(self) -> str: ...
    # --- effects and numbers -----------------------------------------------------------------
    def effects(self) -> dict[str, bool]:
        """Every effect's name, and whether the scene calls for it."""
    def without(self, effect: str) -> Scene:
        """Copy the scene without an effect, and without what makes no sense without it.

        ValueError for an unknown name, or where the rest of the scene needs the effect.
        """
    def with_effect(self, effect: str) -> Scene:
        """Copy the scene with an effect, with values of the usual size; errors as for `without`."""
    def parameters(self) -> dict[str, tuple[float, float, float, str]]:
        """Every number by its dotted name: value, lowest and highest allowed, unit.

        Elements of a list count from 0, as in `control.lifting.K_p.2`.
        """
    def with_values(self, values: dict[str, float]) -> Scene:
        """Copy the scene with other numbers, named as in `parameters`.

        ValueError names what is unknown or out of range.
        """

@final
class Simulator:
    """One robot on one sheet of ice."""

    def __new__(cls, scene: Scene) -> Simulator: ...
    @property
    def scene(self) -> Scene: ...
    # --- shape -----------------------------------------------------------------------------
    @property
    def coordinate_names(self) -> list[str]:
        """The n names, root first: `["y0", "z0", "q1", "q2", ...]`."""
    def size(self) -> dict[str, int]:
        """Count what the scene's effects come to.

        Keys: `dof`, coordinates that move in some contact state; `rows`, most multipliers of the
        free foot; `guards`, different ones that some state watches; and of the present state the
        unknowns of Table 2, `accelerations` and `multipliers`.
        """
    @property
    def action_period(self) -> float:
        """Time that one `step` advances [s]."""
    def bodies(self) -> list[dict[str, Any]]:
        """Describe the rigid bodies, locked joints merged, in the order of the coordinates.

        Keys: `name`, `joint` (coordinate name; the first body carries `y0, z0, q1`), `parent`
        (index, -1 for the first), `axis` ("x", "y" or "z"), `offset` (3,) of its joint in the
        parent's frame [m], `mass` [kg], `com` (3,) in its own frame [m], `inertia` (3, 3) about
        its centre of mass in its own frame [kg m2], `damping` of its joint [N m s/rad].
        """
    # --- state -----------------------------------------------------------------------------
    @property
    def time(self) -> float: ...
    @property
    def q(self) -> _Array:
        """Coordinates (n,), a fresh copy."""
    @property
    def v(self) -> _Array:
        """Their rates (n,), a fresh copy."""
    @property
    def support_leg(self) -> str:
        """`"right"` or `"left"`."""
    @property
    def state_number(self) -> int:
        """Row of Table 2, 1 to 20; 0 when both feet are off the ice."""
    @property
    def state_name(self) -> str:
        """For example `slide_flat/heel_slide`: supporting foot / free foot."""
    @property
    def termination(self) -> str | None:
        """Why the simulation cannot go on, or None.

        `fall`, `jam`, `singular`, `step_limit` or `not_finite`; `docs/hard-cases.md` says when.
        """
    @property
    def torque(self) -> _Array:
        """Generalised torque applied at this instant (n,): baseline plus residual."""
    @property
    def acceleration(self) -> _Array:
        """Rates of `v` at this instant (n,)."""
    @property
    def contact_forces(self) -> _Array:
        """(2, 4): rows supporting, free foot; columns f_y, N, N at the heel, N at the toe [N]."""
    @property
    def head_position(self) -> _Array:
        """Top of the head (3,), world [m]."""
    def observation(self) -> NDArray[np.float32]:
        """Show this state as an environment of the same scene does (d,); a fresh array.

        `IceSkateEnv.observation_names` says what its numbers are.
        """
    def link_segments(self, q: _Array | None = None) -> _Array:
        """(17, 2, 3): both ends of every link of Table 1 in the world, numbered as the paper does.

        A foot's segment is its sole, heel to toe. `q=None` means the present state.
        """
    def reset(
        self,
        q: _Array | None = None,
        v: _Array | None = None,
        support_leg: str | None = None,
        params: dict[str, float] | None = None,
    ) -> None:
        """Go back to the scene's start, or to the given state at t = 0.

        `params` are other numbers for this episode, named as in `Scene.parameters`: friction,
        masses, lengths, gains, gravity. The next reset begins from the scene's own again.

        ValueError, and nothing changed, where the state is not finite, has the wrong shape or
        lies below the ice, or a parameter is unknown or out of range.
        """
    def step(self, residual_torque: _Array | None = None) -> bool:
        """Advance one action period; the residual (16 or n - 3 joint torques) is held over it.

        Returns True while the simulation can go on; afterwards `termination` says why it cannot.
        """
    def perturb(self, sigma: float, seed: int) -> None:
        """Reset to the scene's start, disturbed; the support stays flat on the ice.

        Normal noise is added to the leg angles q2 .. q7 (``sigma`` rad) and to their rates
        (``sigma`` rad/s), and the skating speed is multiplied by ``1 + sigma * n``. A start that
        would put the free foot below the ice is drawn again, up to 100 times.

        ValueError, and nothing changed, where ``sigma`` is outside [0, 10] or no draw is a start.
        """
    def kick(self, speed: float) -> bool:
        """Push: change the forward velocity of every body by ``speed`` [m/s], -10 to 10, at once.

        All joints keep their rates; feet on the ice slide on in their new directions. What has
        ended is left alone. Returns whether the simulation goes on.

        ValueError, and nothing changed, where ``speed`` is out of range, or not 0 on sticking ice.
        """
    # --- what happened -----------------------------------------------------------------------
    def advance(self, until: float, residual_torque: _Array | None = None) -> bool:
        """Go on to the time ``until`` [s] with a residual torque (n - 3,) held, as `step` does.

        Returns whether the simulation goes on. ValueError for a time that has passed.
        """
    # --- a hybrid system for other integrators: right-hand side, guards, reset -----------------
    def rhs(self, t: float, q: _Array, v: _Array) -> _Array:
        """Accelerations (n,) in the present contact state, under the laws the controller applies.

        ValueError where the contact forces have no solution.
        """
    def guards(self, t: float, q: _Array, v: _Array) -> dict[str, float]:
        """Guards of the present contact state: its end comes when one falls through zero.

        One guard that starts below zero counts when it rises through it: ``free toe lands`` in
        two-way contact without contact of the toe alone.
        """
    def sampled(self, t: float, q: _Array, v: _Array) -> bool:
        """Tell whether the controller, sampling every `control.sample_period`, would change."""
    def reset_map(self, t: float, q: _Array, v: _Array, guard: str | None = None) -> bool:
        """Put the robot at (t, q, v) and pass a guard's event; without one, sample the controller.

        Returns whether the simulation goes on. ValueError for a guard that the contact state does
        not have.
        """
    def measure(self, work: str, repeats: int) -> float:
        """Time what the engine needs for ``repeats`` repetitions of some work [s].

        Each begins with a copy of the simulation in its present state, which does not change:
        `rhs`, one evaluation of the accelerations in the present contact state; `step`, one step
        of the scene's own method, and the events in it; `batch`, the same of up to 64 copies at
        once, in the lanes of a batch; `reset`, back to the scene's start; `snapshot`; `restore`,
        undo to a snapshot. The copying is not timed.

        ValueError for other work, fewer repetitions than one, or a simulation that has ended.
        """
    def gaps(self) -> _Array:
        """Heights above the ice (2, 2) [m]: supporting and free foot; heel and toe."""
    def violation(self) -> tuple[float, float]:
        """How far the free foot is off its contact [m, rad], and its rate."""
    def take_events(self) -> list[tuple[float, str, int, int, str]]:
        """Return the last 1,024 events since the last call, oldest first.

        Each is (time, what, state before, state after, supporting leg).
        """
    def take_steps(self) -> list[dict[str, float]]:
        """Return the last 1,024 steps since the last call: swaps of the legs, 0.1 s apart at least.

        Keys: `time` (of the swap), `period`, `slide` (displacement of the supporting foot while it
        slid [m]), `loaded_slide` (the part of it with a tenth of the weight or more on that foot
        [m]), `progress` (displacement of the hips [m]), `lowest_head`, `deepest_toe` (lowest point
        of the free toe, negative below the ice [m]), `inadmissible_time` [s].
        """
    def totals(self) -> dict[str, float]:
        """Sum up since the reset, unfinished steps included.

        Keys: `slide` and `loaded_slide` [m] as in `take_steps`; `steps`, how often the load has
        passed to the other leg, which means that it supports and carries a tenth of the weight,
        0.15 s or more after the last time; `flight_time`, both feet in the air, and
        `double_support_time`, both on the ice [s].
        """
    def stats(self) -> dict[str, float]:
        """Count since the reset.

        Keys: `steps`, `rejections`, `evaluations` of the right-hand side, `factorisations` by the
        implicit method, `root_iterations`, `events`, `projections`; `error_estimate`, the sum of
        the local errors as the method estimates them [rad, m]; with an energy balance `energy_residual`,
        the unaccounted energy [J].
        """
    def energy_balance(self) -> dict[str, float]:
        """Energy balance since the reset [J].

        Keys: `actuators` and `kicks`, brought in; `damping`, `friction`, `impacts` and `capture`
        (feet made to stick), taken out.

        ValueError where the scene has `energy_balance = false`.
        """
    def snapshot(self) -> bytes:
        """Everything needed to continue bit for bit."""
    def restore(self, data: bytes) -> None:
        """Undo to a snapshot of a simulator of the same scene; ValueError if it is damaged."""
    # A pickle or a copy holds what a snapshot does: not the events and steps not yet taken.
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
        sagittal plane only, and its reaction takes up the other components.
        """

@final
class Batch:
    """Episodes of ``IceSkate-v0``, advanced together; `skate_env.vector` makes it an environment.

    Environments are numbered from 0; ValueError where there is none of that number. Infos have the
    keys that ``docs/iceskate-v0.md`` lists.
    """

    def __new__(
        cls,
        scene: Scene,
        n: int,
        *,
        action_scale: list[float],
        weights: tuple[float, float, float],
        torque_limit: float,
        perturb: float,
        trunk_noise: float,
        kick: float,
        limit: int | None,
        autoreset: str,
        threads: int | None,
    ) -> Batch:
        """Make ``n`` episodes that wait for their first reset.

        Parameters
        ----------
        action_scale
            Residual torque of a full action, one number per joint [N m].
        weights
            Of slide [1/m], head [1/s] and effort [1/s].
        torque_limit
            An action may not take a joint beyond it, nor beyond the baseline's own torque [N m].
        perturb
            Disturbance of every start, as for `Simulator.perturb`, 0 to 10.
        trunk_noise
            Normal noise on angles [rad] and rates [rad/s] of q8 and q10 at every start, 0 to 1; 0
            where the scene locks both.
        kick
            Speed of the kicks, 2 to 6 s apart, that an episode gets [m/s], 0 to 10; 0 on sticking
            ice.
        limit
            Actions after which an episode is truncated; None for never.
        autoreset
            ``"NextStep"``, ``"SameStep"`` or ``"Disabled"``.
        threads
            How many may work at once, None for one per core. A process has one pool of them.
        """
    @property
    def joint_names(self) -> list[str]:
        """Joints that an action moves, in order."""
    @property
    def action_period(self) -> float:
        """Time that an action is held [s]."""
    @property
    def lanes(self) -> int:
        """Environments that share a vector register, where steps are fixed: 1, 2, 4 or 8.

        As many as the processor can. May be set to fewer, 1 for one by one, which takes longer and
        changes nothing else; ValueError for a number that the processor does not have.
        """
    @lanes.setter
    def lanes(self, lanes: int) -> None: ...
    def observation_entries(self) -> list[tuple[str, str, str, float, float]]:
        """Name, meaning, unit, lowest and highest value of every number of an observation."""
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
        """Begin episodes of the environments ``which``; None stands for the scene's own.

        Parameters
        ----------
        seeds
            Each begins a sequence of random numbers; where it is None the last goes on.
        elapsed
            Actions of the time limit that count as made.
        q, v, support_leg
            State to start from; it is disturbed only by ``perturb``.
        params
            Numbers of these episodes, as for `Simulator.reset`; they go before drawn ones.
        phase
            Steps that the baseline makes before, with a fraction of the next one.

        Raises
        ------
        ValueError
            Where one of them has no such start; nothing has changed.
        """
    def is_seeded(self, i: int) -> bool:
        """Tell whether environment ``i`` has been given a seed."""
    def waiting(self) -> tuple[int, bool] | None:
        """Return the first environment that needs a reset, and whether its episode is over."""
    def observe(self) -> NDArray[np.float32]:
        """Observations of the present states (n, d)."""
    def info(self, i: int) -> dict[str, float | int | str | None]:
        """Info of environment ``i`` after the last step or reset."""
    def infos_each(self) -> list[dict[str, Any]]:
        """Infos of all environments one by one, as Stable-Baselines3 has them, after a step.

        With ``TimeLimit.truncated``; of those that it has reset what they ended with, and
        ``terminal_observation``.
        """
    def infos(self, which: list[int] | None = None) -> dict[str, Any]:
        """Infos in Gymnasium's form: an array a key, and a mask ``_key`` of those that have it.

        Of some environments, with zeros and None for the others; or of all after a step, with
        ``final_obs`` and ``final_info`` where it has reset some.
        """
    def step(
        self, actions: Any
    ) -> tuple[
        NDArray[np.float32],
        _Array,
        NDArray[np.bool_],
        NDArray[np.bool_],
    ]:
        """Hold actions (n, joints) for a period.

        Returns observations (n, d), rewards, terminated, truncated (n,).

        TypeError where actions are no real numbers; ValueError where their shape is another, one is
        not finite, or an environment waits for a reset.
        """
    def step_alone(
        self, action: Any
    ) -> tuple[NDArray[np.float32], float, bool, dict[str, float | int | str | None]]:
        """Hold an action (joints,) for a period, where there is one environment.

        Returns observation (d,), reward, terminated and `info`. Errors as for `step`.
        """
    def simulator(self, i: int) -> Simulator:
        """Copy environment ``i``'s simulator, events included."""
    def snapshot(self, i: int) -> bytes:
        """Save what environment ``i`` needs to continue bit for bit, random state included."""
    def restore(self, i: int, data: bytes) -> None:
        """Undo environment ``i`` to a snapshot of one of the same scene; ValueError if damaged."""
