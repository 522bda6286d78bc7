"""The vector environment of ``IceSkate-v0``, which uses the engine's threads."""

from collections.abc import Sequence
from functools import cached_property
from typing import Any

import numpy as np
from gymnasium.error import ClosedEnvironmentError, ResetNeeded
from gymnasium.vector import AutoresetMode, VectorEnv
from gymnasium.vector.utils import batch_space
from numpy.typing import NDArray
from typing_extensions import Unpack

from .._core import Batch, Simulator
from ..common import arguments, shown
from ..gradients import StepDerivatives
from ..render import EnvPictures, Renderer
from ..scenes import SceneSource
from . import config
from .config import EnvironmentProperties, Keywords, Observation

Array = NDArray[Any]


class IceSkateVectorEnv(EnvironmentProperties, VectorEnv[Observation, Observation, Array]):
    """A batch of environments; number i equals `IceSkateEnv` bit for bit.

    ``gymnasium.make_vec("IceSkate-v0", num_envs=64)`` makes it. Observations, infos, masks,
    ``final_obs`` and ``final_info`` are those of `gymnasium.vector.SyncVectorEnv`.

    Parameters
    ----------
    num_envs
        Number of environments.
    max_episode_steps
        Actions after which an episode is truncated; None or -1 for never.
    autoreset_mode
        ``NEXT_STEP`` (the step after an episode's end resets and ignores its action), ``SAME_STEP``
        (the same step resets; the end is in ``final_obs`` and ``final_info``), or ``DISABLED``
        (reset with ``options["reset_mask"]``). An autoreset uses the scene's start, without the
        options of the last `reset`.
    num_threads
        Number of threads; None for one per core. Results do not depend on it. All environments of a
        process share one pool.
    scene, accuracy, action_period, joints, action_scale, torque_limit, mirrored, reward, \
perturb, trunk_noise, kick
        As for `IceSkateEnv`.
    render_mode
        None or ``"rgb_array"``.

    Raises
    ------
    TypeError, ValueError
        If a keyword is invalid; the message names it, its value and the allowed values.

    Examples
    --------
    >>> import gymnasium
    >>> envs = gymnasium.make_vec("skate_env:IceSkate-v0", num_envs=8)
    >>> observations, infos = envs.reset(seed=0)
    >>> observations.shape, infos["steps"].shape
    ((8, 76), (8,))
    """

    def __init__(
        self,
        num_envs: int = 1,
        scene: SceneSource = "paper",
        *,
        max_episode_steps: int | None = 3000,
        autoreset_mode: AutoresetMode | str = AutoresetMode.NEXT_STEP,
        num_threads: int | None = None,
        render_mode: str | None = None,
        **keywords: Unpack[Keywords],
    ) -> None:
        self._arguments = config.batch_arguments(scene, keywords)
        threads = num_threads
        self.num_envs = arguments.count("num_envs", num_envs)
        self._limit = arguments.action_limit(max_episode_steps)
        self._threads = None if threads is None else arguments.count("num_threads", threads)
        self._mode = arguments.autoreset(autoreset_mode)
        self._batch = self._new_batch()
        if render_mode not in (None, "rgb_array"):
            raise ValueError(f'render_mode = {shown(render_mode)}: must be None or "rgb_array"')
        self.render_mode = render_mode
        pictures = EnvPictures.metadata(self._batch.action_period)
        self.metadata = pictures | {"render_modes": ["rgb_array"], "autoreset_mode": self._mode}
        self.single_action_space, self.single_observation_space = config.box_spaces(self._batch)
        self.action_space = batch_space(self.single_action_space, self.num_envs)
        self.observation_space = batch_space(self.single_observation_space, self.num_envs)

    def reset(
        self,
        *,
        seed: int | Sequence[int | None] | None = None,
        options: dict[str, Any] | None = None,
    ) -> tuple[Observation, dict[str, Any]]:
        """Start episodes.

        Parameters
        ----------
        seed
            Environment i takes ``seed + i``, or the i-th of a list; None continues the sequences.
        options
            As for `IceSkateEnv.reset`, for every environment. ``reset_mask`` (n,) of bool selects
            environments. ``elapsed`` (n,) of int: actions of ``max_episode_steps`` that count as
            made, so that time limits differ.

        Returns
        -------
        observations, infos
            Observations (n, d) of all environments; infos have masks of those that were reset.

        Raises
        ------
        TypeError, ValueError
            If an option or a start is invalid; no environment has changed.
        """
        self._check_open()
        given = arguments.table("options", {} if options is None else options)
        which = arguments.reset_mask(given.pop("reset_mask", None), self.num_envs)
        elapsed = arguments.elapsed_actions(given.pop("elapsed", None), self.num_envs)
        given = arguments.reset_arguments(given)
        seeds = self._seeds(seed)
        places = np.flatnonzero(which).tolist()
        # Environments that have never had a seed draw one; a refused reset takes the draws back.
        draws = any(seeds[i] is None and not self._batch.is_seeded(i) for i in places)
        before = self.np_random.bit_generator.state if draws else None
        drawn = [self._seed(seeds[i], i) for i in places]
        try:
            self._batch.reset(places, drawn, [elapsed[i] for i in places], **given)
        except BaseException:
            if before is not None:
                self.np_random.bit_generator.state = before
            raise
        if not isinstance(seed, list | tuple | np.ndarray):
            super().reset(seed=seeds[0])
        return self._batch.observe(), self._batch.infos(places)

    def step(self, actions: Observation) -> tuple[Observation, Array, Array, Array, dict[str, Any]]:
        """Apply constant residual torques (n, joints) over one action period.

        Returns
        -------
        observations, rewards, terminated, truncated, infos
            (n, d) and (n,). For an ended episode they depend on the autoreset mode.

        Raises
        ------
        TypeError, ValueError
            If the actions have another type or shape, or a number is not finite; no environment has
            changed.
        ResetNeeded
            Before the first reset; without autoreset also after an episode's end.
        KeyboardInterrupt
            Some environments have made the whole action, the others none; `info` tells the time of
            each. The results of this step are lost.
        """
        return *self.advance(actions), self._batch.infos()

    def advance(self, actions: Observation) -> tuple[Observation, Array, Array, Array]:
        """Make a `step` without its infos; `info` returns those of one environment."""
        self._check_open()
        try:
            return self._batch.step(actions)
        except ValueError:
            config.check_ready(self._batch)
            raise

    def advance_differentiated(
        self, actions: Observation
    ) -> tuple[Observation, Array, Array, Array, StepDerivatives]:
        """Make an `advance`, bit for bit, and differentiate it in the same threads.

        The derivatives pass through all events, see docs/gradients.md. What the reward counts as
        loaded is held, and so is every limit that applies. With ``SAME_STEP`` a new episode does
        not depend on the one before, and its state and observation have no derivatives.

        Raises
        ------
        TypeError, ValueError, ResetNeeded
            As `step` does; ValueError also with `torque_limit`, with `kick`, for an accuracy
            without derivatives, and where the memory does not suffice. No environment has changed.
        """
        self._check_open()
        try:
            results, found = self._batch.step_differentiated(actions)
        except ValueError:
            config.check_ready(self._batch)
            raise
        derivatives = StepDerivatives(**found)
        if self._mode == AutoresetMode.SAME_STEP:
            begins = results[2] | results[3]
            for part in (derivatives.A, derivatives.B, derivatives.observation):
                part[begins] = 0.0
        return *results, derivatives

    def state_vectors(self) -> Array:
        """Return the states (n, z) of `StepDerivatives`.

        Each is `Simulator.state_vector`, then the time of the last change of the contact state [s],
        the position of the hips at the start of the gait step, and the loaded slide since then [m].
        """
        return self._batch.states()

    def info(self, i: int) -> dict[str, Any]:
        """Return the info of environment ``i`` in plain values; ValueError for a wrong index."""
        return self._batch.info(i)

    def infos_each(self) -> list[dict[str, Any]]:
        """Return the infos of the last step in the format of Stable-Baselines3.

        They are plain values with ``TimeLimit.truncated``. For an environment that the step has
        reset they are the infos of the ended episode, with ``terminal_observation``.
        """
        return self._batch.infos_each()

    def render(self) -> tuple[NDArray[np.uint8], ...] | None:
        """Draw every environment (540, 960, 3); None without ``render_mode="rgb_array"``.

        Raises
        ------
        ResetNeeded
            Before the first reset of an environment.
        """
        self._check_open()
        if self.render_mode is None:
            return None
        if not all(self._batch.is_seeded(i) for i in range(self.num_envs)):
            raise ResetNeeded("render() before reset(): there is nothing to draw yet")
        return tuple(self._renderer.draw(self.simulator(i)) for i in range(self.num_envs))

    @cached_property
    def _renderer(self) -> Renderer:
        return Renderer()

    def simulator(self, i: int) -> Simulator:
        """Return a copy of environment ``i``'s simulator; ValueError for a wrong index."""
        return self._batch.simulator(i)

    def snapshot(self) -> list[bytes]:
        """Return the complete state of each environment; it continues bit for bit."""
        return [self._batch.snapshot(i) for i in range(self.num_envs)]

    def restore(self, data: Sequence[bytes]) -> None:
        """Restore snapshots, one for each environment; they may come from an `IceSkateEnv`.

        Raises
        ------
        TypeError, ValueError
            If their number or keywords differ, or one is damaged; no environment has changed.
        """
        self._check_open()
        if not isinstance(data, list | tuple):
            raise TypeError(f"snapshots: must be a list of bytes, not {type(data).__name__}")
        if len(data) != self.num_envs:
            raise ValueError(f"{len(data)} snapshots: must be {self.num_envs}")
        self._batch = self._batch_of(data)

    def __getstate__(self) -> dict[str, Any]:
        """Pickles and copies hold the keywords and snapshots."""
        kept = {key: value for key, value in self.__dict__.items() if key != "_renderer"}
        return kept | {"_batch": self.snapshot()}

    def __setstate__(self, state: dict[str, Any]) -> None:
        # A damaged snapshot changes nothing.
        fresh = object.__new__(type(self))
        fresh.__dict__.update(state)
        batch = fresh._batch_of(state["_batch"])
        self.__dict__.update(state | {"_batch": batch})

    def _new_batch(self) -> Batch:
        return Batch(
            n=self.num_envs,
            limit=self._limit,
            autoreset=self._mode.value,
            threads=self._threads,
            **self._arguments,
        )

    def _batch_of(self, data: Sequence[bytes]) -> Batch:
        batch = self._new_batch()
        for i, one in enumerate(data):
            batch.restore(i, one)
        return batch

    def _seeds(self, given: int | Sequence[int | None] | None) -> list[int | None]:
        """Return a seed for every environment."""
        if isinstance(given, list | tuple | np.ndarray):
            if len(given) != self.num_envs:
                raise ValueError(f"{len(given)} seeds: must be {self.num_envs}, one each")
            return [arguments.seed_of(seed) for seed in given]
        seed = arguments.seed_of(given)
        return [None if seed is None else arguments.seed_of(seed + i) for i in range(self.num_envs)]

    def _seed(self, given: int | None, i: int) -> int | None:
        """Return environment i's seed; draw one if it has never had a seed."""
        if given is None and not self._batch.is_seeded(i):
            return int(self.np_random.integers(2**63))
        return given

    def _check_open(self) -> None:
        if self.closed:
            raise ClosedEnvironmentError("the environment is closed: make a new one")
