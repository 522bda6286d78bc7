"""A batch of environments without simulation, for Stable-Baselines3."""

from typing import Any

import numpy as np
from gymnasium import spaces
from numpy.typing import NDArray
from stable_baselines3.common.vec_env.base_vec_env import VecEnv, VecEnvIndices

Infos = list[dict[str, Any]]


class NullVecEnv(VecEnv):
    """Returns prepared observations (k, n, d) cyclically and a reward of 1; episodes never end."""

    def __init__(
        self, observations: NDArray[np.float32], observed: spaces.Space[Any], acted: Any
    ) -> None:
        n = observations.shape[1]
        super().__init__(n, observed, acted)
        self._observations, self._index = observations, 0
        self._rewards, self._dones = np.ones(n, np.float32), np.zeros(n, np.bool_)
        self._infos: Infos = [{} for _ in range(n)]

    def reset(self) -> NDArray[np.float32]:
        """Return the first observations."""
        first: NDArray[np.float32] = self._observations[0]
        return first

    def step_async(self, actions: NDArray[Any]) -> None:
        """Ignore the actions."""

    def step_wait(
        self,
    ) -> tuple[NDArray[np.float32], NDArray[np.float32], NDArray[np.bool_], Infos]:
        """Return the next observations."""
        self._index = (self._index + 1) % len(self._observations)
        return self._observations[self._index], self._rewards, self._dones, self._infos

    def close(self) -> None:
        """Do nothing."""

    def get_attr(self, attr_name: str, indices: VecEnvIndices = None) -> list[Any]:
        """Return None for every environment; a learner reads the render mode only."""
        return [None for _ in self._get_indices(indices)]

    def set_attr(self, attr_name: str, value: Any, indices: VecEnvIndices = None) -> None:
        """Raise AttributeError."""
        raise AttributeError(attr_name)

    def env_method(
        self, method_name: str, *method_args: Any, indices: VecEnvIndices = None, **keywords: Any
    ) -> list[Any]:
        """Raise AttributeError."""
        raise AttributeError(method_name)

    def env_is_wrapped(self, wrapper_class: type[Any], indices: VecEnvIndices = None) -> list[bool]:
        """Return False for every environment."""
        return [False for _ in self._get_indices(indices)]
