"""The Gymnasium environment ``IceSkate-v0``."""

from typing import Any

import gymnasium
import numpy as np
from gymnasium.error import ClosedEnvironmentError
from numpy.typing import NDArray
from typing_extensions import Unpack

from .._core import Batch, Simulator
from ..common import arguments
from ..render import EnvPictures
from ..scenes import SceneSource
from . import config
from .config import EnvironmentProperties, Keywords, Observation


class IceSkateEnv(EnvironmentProperties, gymnasium.Env[Observation, Observation]):
    """Skating with a residual torque on top of the paper's controller.

    The 17-link humanoid of Zhang et al. skates under the scene's own controller; the action adds to
    its torques. ``docs/iceskate-v0.md`` describes actions, observations and rewards number by
    number.

    Parameters
    ----------
    scene
        A `Scene`, a preset's name, the path of a scene file (``.toml``), or a table of fields as in
        ``Scene.to_json``, with which ``env.spec.to_json()`` works.
    accuracy
        Replaces the scene's accuracy: ``"fast"``, ``"balanced"``, ``"reference"``, a tolerance, or
        a method's table; see ``docs/accuracy.md``.
    action_period
        Replaces the scene's action period [s]. The controller keeps its own, shorter sample period.
    joints
        Joints that an action moves, in its order: a list, ``"all"``, or None for legs, trunk and
        neck.
    action_scale
        Residual torque of a full action [N m]: a number for all joints, or numbers by joint,
        ``{"q2": 100.0}``, for some; otherwise `skate_env.environments.TORQUE_SCALE`.
    torque_limit
        Limit of baseline plus residual at the beginning of an action [N m]; the baseline alone may
        exceed it. None for no limit.
    mirrored
        Whether states with left support are shown and acted on as in a mirror, so that the right
        leg always supports in observations.
    reward
        Weights and limits of the reward that replace the default ones, ``{"slide": 2.0}``;
        `skate_env._core.REWARD_WEIGHTS` lists them.
    perturb
        Perturbation of every start [rad, rad/s and relative speed], see `Simulator.perturb`.
    trunk_noise
        Normal noise on angles [rad] and rates [rad/s] of the trunk's yaw q8 and roll q10 at every
        start, 0 to 1.
    kick
        Random kicks: each changes the velocity of every body by this amount [m/s], 0 to 10,
        forward or backward; see `Simulator.kick`.
    render_mode
        None; ``"rgb_array"``: ``render()`` returns a picture (540, 960, 3); or ``"human"``:
        ``reset`` and ``step`` show it in a window (extra ``render``) until it is closed.

    Raises
    ------
    TypeError, ValueError
        If a keyword is invalid; the message names it, its value and the allowed values.

    Examples
    --------
    >>> import gymnasium
    >>> env = gymnasium.make("skate_env:IceSkate-v0", scene="push_only")
    >>> observation, info = env.reset(seed=0)
    >>> observation.shape, env.unwrapped.observation_names[34]
    ((76,), 'slip.support')
    """

    # Declared as in Gymnasium; an instance may replace it.
    metadata: dict[str, Any] = EnvPictures.metadata(0.01)

    def __init__(
        self,
        scene: SceneSource = "paper",
        *,
        render_mode: str | None = None,
        **keywords: Unpack[Keywords],
    ) -> None:
        self._arguments = config.batch_arguments(scene, keywords)
        self._batch = self._new_batch()
        self.action_space, self.observation_space = config.box_spaces(self._batch)
        self.render_mode = render_mode
        self.metadata = EnvPictures.metadata(self.action_period)
        self._pictures = self._new_pictures()
        self._closed = False

    def reset(
        self, *, seed: int | None = None, options: dict[str, Any] | None = None
    ) -> tuple[Observation, dict[str, Any]]:
        """Start an episode; the same seed gives the same start and the same kicks.

        Parameters
        ----------
        seed
            Seed of the random numbers for this start and all later ones; None continues the
            present sequence. An int from 0 to 2**64 - 1.
        options
            ``state``: a dict of ``q`` (n,), ``v`` (n,) and ``support_leg``, or some of them, which
            replaces the scene's start. ``params``: numbers for this episode, named as in
            `Scene.parameters`; they replace those that the scene's ``randomise`` draws.
            ``phase``: gait steps of the baseline before the episode begins, 0 to 1000; 1.5 is
            the middle of the second one, to the nearest action. ``perturb``: replaces the keyword;
            a given state is perturbed only by this option.

        Returns
        -------
        observation, info
            ``docs/iceskate-v0.md`` lists their elements and keys.

        Raises
        ------
        TypeError, ValueError
            If an option or the start is invalid; the environment is unchanged.
        """
        self._check_open()
        given = arguments.reset_arguments(
            arguments.table("options", {} if options is None else options)
        )
        drawn = seed = arguments.seed_of(seed)
        before = None
        if drawn is None and not self._batch.is_seeded(0):
            before = self.np_random.bit_generator.state
            drawn = int(self.np_random.integers(2**63))
        try:
            self._batch.reset([0], [drawn], [0], **given)
        except BaseException:
            if before is not None:
                self.np_random.bit_generator.state = before
            raise
        super().reset(seed=seed)
        self._pictures.after_reset()
        return self._batch.observe()[0], self._batch.info(0)

    def step(self, action: Observation) -> tuple[Observation, float, bool, bool, dict[str, Any]]:
        """Apply a constant residual torque over one action period.

        Parameters
        ----------
        action
            One number for each joint of `joint_names`, clipped to [-1, 1].

        Returns
        -------
        observation, reward, terminated, truncated, info
            ``truncated`` is False: the wrapper of `gymnasium.make` has the time limit.

        Raises
        ------
        TypeError, ValueError
            If the action has another type or shape, or a number is not finite; the environment is
            unchanged.
        ResetNeeded
            Before the first reset, and after the episode's end.
        """
        self._check_open()
        try:
            observation, reward, terminated, info = self._batch.step_alone(action)
        except ValueError:
            config.check_ready(self._batch)
            raise
        self._pictures.after_step()
        return observation, reward, terminated, False, info

    def render(self) -> NDArray[np.uint8] | None:
        """Draw the present state (540, 960, 3); None for other modes than ``"rgb_array"``.

        Raises
        ------
        ResetNeeded
            Before the first reset.
        """
        self._check_open()
        return self._pictures.render()

    def close(self) -> None:
        """Close the environment; further calls have no effect."""
        self._pictures.close()
        self._closed = True

    @property
    def simulator(self) -> Simulator:
        """A copy of the simulator in its present state, for inspection or experiments."""
        return self._batch.simulator(0)

    def snapshot(self) -> bytes:
        """Return the complete state, random generator included; it continues bit for bit."""
        return self._batch.snapshot(0)

    def restore(self, data: bytes) -> None:
        """Restore a snapshot of this environment or of another with the same keywords.

        A snapshot holds neither keywords nor the state of wrappers, such as a time limit.

        Raises
        ------
        TypeError, ValueError
            If it is not a snapshot or damaged; the environment is unchanged.
        """
        self._check_open()
        self._batch.restore(0, data)
        self._show_restored()

    def __getstate__(self) -> dict[str, Any]:
        """Pickles and copies hold the keywords and a snapshot."""
        kept = {key: value for key, value in self.__dict__.items() if key != "_pictures"}
        return kept | {"_batch": self.snapshot()}

    def __setstate__(self, state: dict[str, Any]) -> None:
        # A damaged snapshot changes nothing.
        fresh = object.__new__(type(self))
        fresh.__dict__.update(state)
        batch = fresh._new_batch()
        batch.restore(0, state["_batch"])
        self.__dict__.update(state | {"_batch": batch})
        self._pictures = self._new_pictures()
        self._show_restored()

    def _new_batch(self) -> Batch:
        return Batch(n=1, limit=None, autoreset="Disabled", threads=1, **self._arguments)

    def _show_restored(self) -> None:
        waiting = self._batch.waiting()
        if waiting is None or waiting[1]:
            self._pictures.after_reset()

    def _new_pictures(self) -> EnvPictures:
        return EnvPictures(self.render_mode, self.action_period, lambda: self.simulator)

    def _check_open(self) -> None:
        if self._closed:
            raise ClosedEnvironmentError("the environment is closed: make a new one")
