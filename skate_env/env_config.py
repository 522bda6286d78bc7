"""Keywords and spaces of the single and the vector environment."""

import json
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from gymnasium import spaces
from gymnasium.error import ResetNeeded
from numpy.typing import NDArray

from ._core import Batch, Scene
from .scenes import as_scene, replace
from .validation import known, real

# Residual torque of a full action [N m]. Legs and yaw have the largest amplitude that the paper
# prints (Eqs. 17 to 22). It prints none for the others: the supporting hip has the value of the
# free hip, the trunk that of the yaw, and arms and head have values that move them.
TORQUE_SCALE: dict[str, float] = {
    "q2": 205.0,
    "q3": 50.0,
    "q4": 100.0,
    "q5": 100.0,
    "q6": 20.0,
    "q7": 50.0,
    "q8": 30.0,
    "q9": 30.0,
    "q10": 30.0,
    "q11": 10.0,
    "q12": 5.0,
    "q13": 1.0,
    "q14": 10.0,
    "q15": 5.0,
    "q16": 1.0,
    "q17": 5.0,
}


Observation = NDArray[np.float32]
Space = spaces.Space[Observation]


@dataclass(frozen=True)
class Settings:
    """Checked keywords of an environment; see `IceSkateEnv`."""

    scene: Scene
    action_scale: tuple[float, ...]
    torque_limit: float
    weights: tuple[float, float, float]
    perturb: float
    trunk_noise: float
    kick: float

    def batch(self, n: int, limit: int | None, autoreset: str, threads: int | None) -> Batch:
        """Build a batch of ``n`` episodes before their first reset."""
        return Batch(
            self.scene,
            n,
            action_scale=list(self.action_scale),
            weights=self.weights,
            torque_limit=self.torque_limit,
            perturb=self.perturb,
            trunk_noise=self.trunk_noise,
            kick=self.kick,
            limit=limit,
            autoreset=autoreset,
            threads=threads,
        )


class Described:
    """Properties shared by the single and the vector environment."""

    _batch: Batch
    _settings: Settings

    @property
    def joint_names(self) -> list[str]:
        """Joints that an action moves, in order."""
        return self._batch.joint_names

    @property
    def observation_names(self) -> list[str]:
        """Names of an observation's elements, in order."""
        return [name for name, *_ in self._batch.observation_entries()]

    @property
    def action_period(self) -> float:
        """Duration of an action [s]."""
        return self._batch.action_period

    @property
    def scene(self) -> Scene:
        """The scene with the changes of the keywords; episodes may have other numbers."""
        return self._settings.scene


def settings(
    scene: Scene | str | Path,
    accuracy: str | float | Mapping[str, Any] | None,
    action_period: float | None,
    action_scale: float | Mapping[str, float] | None,
    torque_limit: float | None,
    slide_weight: float,
    head_weight: float,
    effort_weight: float,
    perturb: float,
    trunk_noise: float,
    kick: float,
) -> Settings:
    """Check an environment's keywords.

    Raises
    ------
    TypeError, ValueError
        If a keyword is invalid; the message names it, its value and the allowed values.
    """
    scene = as_scene(scene)
    changes: dict[str, Any] = {}
    if accuracy is not None:
        changes["accuracy"] = accuracy
    if action_period is not None:
        changes["control.action_period"] = real("action_period", action_period)
    scene = replace(scene, changes) if changes else scene
    return Settings(
        scene=scene,
        action_scale=_scales(scene, action_scale),
        torque_limit=np.inf if torque_limit is None else real("torque_limit", torque_limit),
        weights=(
            real("slide_weight", slide_weight),
            real("head_weight", head_weight),
            real("effort_weight", effort_weight),
        ),
        perturb=real("perturb", perturb),
        trunk_noise=real("trunk_noise", trunk_noise),
        kick=real("kick", kick),
    )


def joints(scene: Scene | str | Path) -> list[str]:
    """Return the joints that an action moves, in order: those that the scene does not lock."""
    locked = json.loads(as_scene(scene).to_json())["locked"]
    return [joint for joint in TORQUE_SCALE if joint not in locked]


def box_spaces(batch: Batch) -> tuple[Space, Space]:
    """Build the action and the observation space of one environment."""
    entries = batch.observation_entries()
    low, high = (np.array([entry[i] for entry in entries], np.float32) for i in (3, 4))
    action: Space = spaces.Box(-1.0, 1.0, (len(batch.joint_names),), np.float32)
    return action, spaces.Box(low, high, dtype=np.float32)


def check_ready(batch: Batch) -> None:
    """Check that all episodes have begun and are not over.

    Raises
    ------
    ResetNeeded
        The message names the first environment that cannot step.
    """
    if (waiting := batch.waiting()) is not None:
        i, over = waiting
        why = "its episode is over" if over else "it has not been reset"
        raise ResetNeeded(f"environment {i} cannot step: {why}; call reset first")


def _scales(scene: Scene, given: float | Mapping[str, float] | None) -> tuple[float, ...]:
    moving = joints(scene)
    if given is None:
        scales = TORQUE_SCALE
    elif isinstance(given, Mapping):
        known("joint in action_scale", given, moving)
        scales = TORQUE_SCALE | {
            joint: real(f"action_scale[{joint!r}]", scale) for joint, scale in given.items()
        }
    else:
        scales = dict.fromkeys(moving, real("action_scale", given))
    return tuple(scales[joint] for joint in moving)
