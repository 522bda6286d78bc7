"""A training on several scenes: their environments as one vector environment."""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from numpy.typing import NDArray
from stable_baselines3.common.vec_env.base_vec_env import VecEnv

from skate_env import Scene
from skate_env.learning.ppo import Training
from skate_env.sb3 import IceSkateVecEnv, Infos


class SeveralScenes(IceSkateVecEnv):
    """Batches one after the other, as far as a training needs it: seeds, resets and steps.

    ``batch`` and all other methods are those of the first one. Raises ValueError if observations
    or joints of the scenes differ.
    """

    def __init__(self, parts: Sequence[IceSkateVecEnv]) -> None:
        self.parts, self.batch = parts, parts[0].batch
        for part in parts[1:]:
            for names in ("observation_names", "joint_names"):
                if getattr(part.batch, names) != getattr(self.batch, names):
                    raise ValueError(f"scenes of one training: their {names} differ")
        # Of the base class alone: the batches are there.
        VecEnv.__init__(
            self,
            sum(part.num_envs for part in parts),
            parts[0].observation_space,
            parts[0].action_space,
        )
        self._first = np.cumsum([0, *(part.num_envs for part in parts)])

    def reset(self) -> NDArray[np.float32]:
        """Start all episodes with the seeds that were set, used once."""
        for part, first in zip(self.parts, self._first[:-1].tolist(), strict=True):
            if self._seeds[first] is not None:
                part.seed(self._seeds[first])
        self._reset_seeds()
        observations = np.concatenate([part.reset() for part in self.parts])
        self._join_reset_infos()
        return observations

    def step_async(self, actions: NDArray[np.float32]) -> None:
        """Set the actions (num_envs, joints) of `step_wait`."""
        for part, chosen in zip(self.parts, np.split(actions, self._first[1:-1]), strict=True):
            part.step_async(chosen)

    def step_wait(
        self,
    ) -> tuple[NDArray[np.float32], NDArray[np.float32], NDArray[np.bool_], Infos]:
        """Apply the actions, as `IceSkateVecEnv` does."""
        observations, rewards, over, infos = zip(
            *(part.step_wait() for part in self.parts), strict=True
        )
        self._join_reset_infos()
        joined = [info for of_part in infos for info in of_part]
        return np.concatenate(observations), np.concatenate(rewards), np.concatenate(over), joined

    def close(self) -> None:
        """Close the batches."""
        for part in self.parts:
            part.close()

    def _join_reset_infos(self) -> None:
        self.reset_infos = [info for part in self.parts for info in part.reset_infos]


@dataclass(frozen=True)
class SeveralTraining(Training):
    """A training in which `scene` and further ones have equal shares of the environments."""

    others: tuple[Scene, ...]

    def environments(
        self, accuracy: Any, episode: int, reward: dict[str, float] | None = None
    ) -> IceSkateVecEnv:
        """Build the environments of a part of the training."""
        scenes, numbers = (self.scene, *self.others), self.numbers
        if numbers.envs < len(scenes):
            raise ValueError(f"envs = {numbers.envs}: must be at least the {len(scenes)} scenes")
        parts = []
        for place, scene in enumerate(scenes):
            share = replace(numbers, envs=(numbers.envs + place) // len(scenes))
            alone = Training(scene, self.seed, share, self.threads, {})
            parts.append(alone.environments(accuracy, episode, reward))
        return SeveralScenes(parts)
