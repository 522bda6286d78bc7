"""Baselines for learned policies: a scene's controller, in full or in part.

Each is a scene together with the zero action::

    policy = skate_env.baseline.no_residual("push_only")
    policy = skate_env.baseline.scaled_feedforward("push_only", 0.5)
    policy = skate_env.baseline.lifting_only("push_only")

    env = gymnasium.make("IceSkate-v0", scene=policy.scene)
    observation, info = env.reset(seed=0)
    action, _ = policy.predict(observation)

Examples
--------
>>> import skate_env
>>> policy = skate_env.baseline.scaled_feedforward("push_only", 0.5)
>>> policy.scene.get("control.feedforward.scale")
0.5
"""

from dataclasses import dataclass
from typing import Any

import numpy as np

from .._core import Scene
from ..common import array_of, real
from ..environments import Observation, chosen_joints
from ..scenes import SceneSource, as_scene, replace


@dataclass(frozen=True)
class Baseline:
    """A controller without residual torques, which the environments of its `scene` include."""

    scene: Scene

    def predict(
        self,
        observation: Observation,
        state: Any = None,
        episode_start: Any = None,
        deterministic: bool = True,
    ) -> tuple[Observation, Any]:
        """Return zero actions for one observation (d,) or many (n, d), and the state unchanged.

        Arguments and results are those of `predict` in Stable-Baselines3; only the observation's
        shape counts.
        """
        shape = (*array_of("observation", observation).shape[:-1], len(chosen_joints(self.scene)))
        return np.zeros(shape, np.float32), state


def no_residual(scene: SceneSource = "paper") -> Baseline:
    """Return a scene's controller unchanged; raises as `load_scene`, like the functions below."""
    return Baseline(as_scene(scene))


def scaled_feedforward(scene: SceneSource = "paper", factor: float = 1.0) -> Baseline:
    """Multiply the printed torques, Eqs. 16 to 22; lifting and stabilizers are unchanged.

    Torques that the scene does not have remain absent.

    Raises
    ------
    TypeError, ValueError
        If the factor is not a number, or the scaled factor of a torque is out of range.
    """
    scene, factor = as_scene(scene), real("factor", factor)
    changes = {
        name: number * factor
        for name in ("control.feedforward.scale", "control.arm_swing.amplitude")
        if (number := scene.get(name)) is not None
    }
    return Baseline(replace(scene, changes))


def lifting_only(scene: SceneSource = "paper") -> Baseline:
    """Keep visual lifting and the scene's stabilizers, without the printed torques."""
    return scaled_feedforward(scene, 0.0)
