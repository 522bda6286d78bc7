"""What all policies in files share: a scene with its names and torques, and the mirror."""

import dataclasses
from abc import ABC, abstractmethod
from collections.abc import Mapping, Sequence
from functools import cached_property
from pathlib import Path
from typing import Any, TypeVar

import numpy as np
from numpy.typing import NDArray

from .._core import Scene, Simulator
from ..environments import Observation
from ..scenes import Mirror, SceneSource, as_scene
from . import archive, checks

Array = NDArray[np.float64]
Single = NDArray[np.float32]
Kind = TypeVar("Kind", bound="Residual")


class Residual(ABC):
    """A residual on top of a scene's controller, mirror symmetric; the base of both policies."""

    scene: Scene
    action_scale: Mapping[str, float]
    observation_names: Sequence[str]
    joint_names: Sequence[str]
    about: Mapping[str, Any]

    def predict(
        self,
        observation: Observation,
        state: Any = None,
        episode_start: Any = None,
        deterministic: bool = True,
    ) -> tuple[Observation, Any]:
        """Return actions for one observation (d,) or many (n, d), and the state unchanged.

        Arguments and results are those of `predict` in Stable-Baselines3. Each action depends on
        its own observation only, bit for bit; with ``deterministic=False`` a `Policy` adds noise.

        Raises
        ------
        TypeError, ValueError
            If the observation does not consist of finite numbers, or has another shape.
        """
        seen = checks.observations(observation, len(self.observation_names))
        left = seen[..., self._leg, None] < 0.0
        # The ranges of a policy's numbers exclude NaN, whatever the caller makes of overflow.
        with np.errstate(all="ignore"):
            right = np.where(left, self._mirrors[0](seen), seen)
            action = self._actions(right, deterministic)
            return np.where(left, self._mirrors[1](action), action), state

    @abstractmethod
    def _actions(self, seen: Array, deterministic: bool) -> Single:
        """Return the actions (..., joints) for observations of right support (..., d)."""

    def residual(self, sim: Simulator) -> Array:
        """Return the residual torques (joints,) [N m] for a simulator's next action period."""
        action, _ = self.predict(sim.observation())
        return np.array(list(self.action_scale.values())) * action

    def environment(self, randomise: bool = False) -> dict[str, Any]:
        """Return the keywords of `gymnasium.make("IceSkate-v0")` of its environment, as for JSON.

        Parameters
        ----------
        randomise
            Whether episodes draw numbers from the ranges of the policy's scene.
        """
        return checks.environment(self.scene, self.action_scale, randomise)

    def on(self: Kind, scene: SceneSource) -> Kind:
        """Copy the policy for another scene: a `Scene`, a preset's name, a file's path, or a table.

        Raises
        ------
        ValueError
            If the scene has other joints or observations.
        """
        changed: Kind = dataclasses.replace(self, scene=as_scene(scene))  # type: ignore[type-var]
        return changed

    def _write(self, path: str | Path, kind: str, arrays: Mapping[str, Any]) -> None:
        """Write arrays and all that is common to a file; the seed is not part of it."""
        text = {name: getattr(self, name) for name in checks.TEXTS[1:]}
        scale = {"action_scale": list(self.action_scale.values())}
        text["scene"] = self.scene.to_toml()
        archive.write(Path(path), kind, {**arrays, **scale}, text)

    @cached_property
    def _mirrors(self) -> tuple[Mirror, Mirror]:
        return Mirror(self.observation_names), Mirror(self.joint_names)

    @cached_property
    def _leg(self) -> int:
        return list(self.observation_names).index("support_leg")
