"""The batch of `IceSkateVectorEnv` with the interface of Stable-Baselines3."""

from collections.abc import Sequence
from typing import Any

import numpy as np
from gymnasium.vector import AutoresetMode
from numpy.typing import NDArray

from .common import arguments
from .environments import IceSkateVectorEnv

try:
    from stable_baselines3.common.vec_env.base_vec_env import VecEnv, VecEnvIndices
except ModuleNotFoundError as error:
    raise ModuleNotFoundError(
        'skate_env.sb3 needs Stable-Baselines3: pip install "skate-env[train]"', name=error.name
    ) from error

Infos = list[dict[str, Any]]


class IceSkateVecEnv(VecEnv):
    """``num_envs`` environments in one batch; wrap it in `VecMonitor` and `VecNormalize`.

    Other keywords are those of `IceSkateVectorEnv`: ``scene``, ``num_threads`` and so on. With
    ``stagger`` a reset spreads the first time limits evenly, as if environment i had already made
    i / num_envs of an episode. Otherwise rollouts would contain only beginnings, then only ends of
    episodes. Evaluate without it.

    Environment i equals the i-th of a `DummyVecEnv`, bit for bit. Attributes are those of the
    batch, methods are called with the environment's index: ``env_method("simulator", indices=3)``.
    """

    def __init__(
        self,
        num_envs: int,
        *,
        stagger: bool = False,
        max_episode_steps: int | None = 3000,
        **keywords: Any,
    ) -> None:
        self.batch = IceSkateVectorEnv(
            num_envs,
            max_episode_steps=max_episode_steps,
            autoreset_mode=AutoresetMode.SAME_STEP,
            **keywords,
        )
        self._stagger: dict[str, Any] = {}
        if stagger:
            limit, n = arguments.action_limit(max_episode_steps), int(num_envs)
            if limit is None:
                raise ValueError("stagger = True: max_episode_steps must be a number")
            # Products of Python's integers do not overflow.
            self._stagger = {"elapsed": [i * limit // n for i in range(n)]}
        space = self.batch.single_observation_space
        super().__init__(num_envs, space, self.batch.single_action_space)
        self.metadata = self.batch.metadata

    def reset(self) -> NDArray[np.float32]:
        """Start all episodes with the seeds and options that were set; both are used once."""
        seeds = None if self._seeds[0] is None else self._seeds
        options = self._stagger | self._options[0]
        # Also those that the batch refuses are used once.
        self._reset_seeds()
        self._reset_options()
        observations, infos = self.batch.reset(seed=seeds, options=options)
        self.reset_infos = [
            self.batch.info(i) if begun else {} for i, begun in enumerate(infos["_time"])
        ]
        return observations

    def set_options(self, options: list[dict[str, Any]] | dict[str, Any] | None = None) -> None:
        """Set the options of the next `reset`; raise TypeError for a list of dicts."""
        if isinstance(options, list):
            raise TypeError("options: a list; the environments of a batch share one dict")
        super().set_options(options)

    def step_async(self, actions: NDArray[np.float32]) -> None:
        """Set the actions (num_envs, joints) of `step_wait`."""
        self._actions = actions

    def step_wait(
        self,
    ) -> tuple[NDArray[np.float32], NDArray[np.float32], NDArray[np.bool_], Infos]:
        """Apply the actions; an ended episode restarts at once.

        Its observation is then that of the new episode, and its info has the last observation of
        the old one as ``terminal_observation``.
        """
        observations, rewards, terminated, truncated = self.batch.advance(self._actions)
        over, infos = terminated | truncated, self.batch.infos_each()
        for i in np.flatnonzero(over).tolist():
            self.reset_infos[i] = self.batch.info(i)
        return observations, rewards.astype(np.float32), over, infos

    def close(self) -> None:
        """Close the batch."""
        self.batch.close()

    def get_images(self) -> Sequence[NDArray[np.uint8] | None]:
        """Return a picture of every environment; None without ``render_mode="rgb_array"``."""
        pictures = self.batch.render()
        return [None] * self.num_envs if pictures is None else pictures

    def get_attr(self, attr_name: str, indices: VecEnvIndices = None) -> list[Any]:
        """Return the batch's attribute, once for every index."""
        return [getattr(self.batch, attr_name) for _ in self._get_indices(indices)]

    def set_attr(self, attr_name: str, value: Any, indices: VecEnvIndices = None) -> None:
        """Raise AttributeError: the environments of a batch cannot be changed."""
        raise AttributeError(f"{attr_name}: the environments of a batch cannot be changed")

    def env_method(
        self, method_name: str, *method_args: Any, indices: VecEnvIndices = None, **keywords: Any
    ) -> list[Any]:
        """Call the batch's method with every index and the arguments."""
        method = getattr(self.batch, method_name)
        return [method(i, *method_args, **keywords) for i in self._get_indices(indices)]

    def env_is_wrapped(self, wrapper_class: type, indices: VecEnvIndices = None) -> list[bool]:
        """Return False for every environment."""
        return [False for _ in self._get_indices(indices)]
