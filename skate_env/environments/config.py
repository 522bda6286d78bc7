"""Keywords and spaces of the single and the vector environment."""

from collections.abc import Mapping, Sequence
from typing import Any, TypedDict

import numpy as np
from gymnasium import spaces
from gymnasium.error import ResetNeeded
from numpy.typing import NDArray

from .._core import Batch, Scene
from ..common import known, real, shown, table
from ..scenes import SceneSource, as_scene, replace

# Joints of an action by default, unless the scene locks them.
SKATING = ("q2", "q3", "q4", "q5", "q6", "q7", "q8", "q9", "q10", "q17")
# Residual torque of a full action [N m]. With 100 N m in legs and trunk policies learn to skate.
TORQUE_SCALE: dict[str, float] = {
    **dict.fromkeys(SKATING[:-1], 100.0),
    "q11": 10.0,
    "q12": 5.0,
    "q13": 1.0,
    "q14": 10.0,
    "q15": 5.0,
    "q16": 1.0,
    "q17": 20.0,
}
# Keywords for actions in all joints, not mirrored. Legs and yaw have the largest amplitude that the
# paper prints (Eqs. 17 to 22). It prints none for the others: the supporting hip has the value of
# the free hip, the trunk that of the yaw.
PAPER_ACTIONS: dict[str, Any] = {
    "joints": "all",
    "mirrored": False,
    "action_scale": TORQUE_SCALE
    | {"q2": 205.0, "q3": 50.0, "q6": 20.0, "q7": 50.0, "q17": 5.0}
    | dict.fromkeys(("q8", "q9", "q10"), 30.0),
}

Observation = NDArray[np.float32]
Space = spaces.Space[Observation]


class Keywords(TypedDict, total=False):
    """Keywords of both environments, after the scene; `IceSkateEnv` describes them."""

    accuracy: str | float | Mapping[str, Any] | None
    action_period: float | None
    joints: str | Sequence[str] | None
    action_scale: float | Mapping[str, float] | None
    torque_limit: float | None
    mirrored: bool
    reward: Mapping[str, float] | None
    perturb: float
    trunk_noise: float
    kick: float


DEFAULTS: Keywords = {
    "accuracy": None,
    "action_period": None,
    "joints": None,
    "action_scale": None,
    "torque_limit": None,
    "mirrored": True,
    "reward": None,
    "perturb": 0.0,
    "trunk_noise": 0.0,
    "kick": 0.0,
}


class EnvironmentProperties:
    """Properties shared by the single and the vector environment."""

    _batch: Batch
    _arguments: dict[str, Any]

    @property
    def joint_names(self) -> list[str]:
        """Joints that an action moves, in order."""
        return self._batch.joint_names

    @property
    def action_scale(self) -> dict[str, float]:
        """Residual torque of a full action by joint of an action [N m]."""
        scale = self._arguments["action_scale"]
        every = dict(zip(joints(self.scene), scale, strict=True))
        return {joint: every[joint] for joint in self.joint_names}

    @property
    def observation_names(self) -> list[str]:
        """Names of an observation's elements, in order."""
        return [name for name, *_ in self._batch.observation_entries()]

    @property
    def action_period(self) -> float:
        """Duration of an action [s]."""
        return self._batch.action_period

    def check_laws(self, on: bool = True) -> None:
        """Check laws of mechanics from now on; `Simulator.laws` of `simulator` has the results."""
        self._batch.check_laws(on)

    @property
    def mirrored(self) -> bool:
        """Whether states with left support are shown and acted on as in a mirror."""
        mirrored: bool = self._arguments["mirrored"]
        return mirrored

    @property
    def scene(self) -> Scene:
        """The scene with the changes of the keywords; episodes may have other numbers."""
        scene: Scene = self._arguments["scene"]
        return scene


def batch_arguments(scene: SceneSource, keywords: Keywords) -> dict[str, Any]:
    """Check an environment's keywords; return the arguments of `Batch`, which checks their ranges.

    Raises
    ------
    TypeError, ValueError
        If a keyword is unknown or invalid; the message names it and the allowed values.
    """
    for name in keywords:
        if name not in DEFAULTS:
            raise TypeError(
                f"unexpected keyword argument {shown(name)}: must be one of {', '.join(DEFAULTS)}"
            )
    given: Keywords = {**DEFAULTS, **keywords}
    changes: dict[str, Any] = {}
    if given["accuracy"] is not None:
        changes["accuracy"] = given["accuracy"]
    if given["action_period"] is not None:
        changes["control.action_period"] = real("action_period", given["action_period"])
    scene = replace(scene, changes) if changes else as_scene(scene)
    if not isinstance(given["mirrored"], bool):
        raise TypeError(f"mirrored = {shown(given['mirrored'])}: must be True or False")
    chosen = chosen_joints(scene, given["joints"])
    limit = given["torque_limit"]
    weights = {} if given["reward"] is None else table("reward", given["reward"])
    return {
        "scene": scene,
        "joints": list(chosen),
        "action_scale": _scales(scene, chosen, given["action_scale"]),
        "torque_limit": np.inf if limit is None else limit,
        "mirrored": given["mirrored"],
        "reward": {name: real(f"reward[{name!r}]", x) for name, x in weights.items()},
        "perturb": given["perturb"],
        "trunk_noise": given["trunk_noise"],
        "kick": given["kick"],
    }


def joints(scene: SceneSource) -> list[str]:
    """Return the joints that an action can move, in order: those that the scene does not lock."""
    locked = as_scene(scene).get("locked")
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


def chosen_joints(scene: SceneSource, given: str | Sequence[str] | None = None) -> tuple[str, ...]:
    """Return the joints of an action for the keyword ``joints``.

    Raises
    ------
    TypeError, ValueError
        If the keyword is not a list of names or ``"all"``; `Batch` checks the names.
    """
    moving = joints(scene)
    if given is None:
        return tuple(joint for joint in moving if joint in SKATING)
    if isinstance(given, str):
        if given != "all":
            raise ValueError(f'joints = {given!r}: must be "all" or a list of joints')
        return tuple(moving)
    if not isinstance(given, Sequence) or not all(isinstance(joint, str) for joint in given):
        raise TypeError(f'joints = {shown(given)}: must be "all" or a list of joints')
    return tuple(given)


def _scales(
    scene: Scene, chosen: Sequence[str], given: float | Mapping[str, float] | None
) -> list[float]:
    """Return the torque of a full action of every joint that the scene does not lock."""
    moving = joints(scene)
    if given is None:
        scales = TORQUE_SCALE
    elif isinstance(given, Mapping):
        known("joint in action_scale", given, chosen)
        scales = TORQUE_SCALE | {
            joint: real(f"action_scale[{joint!r}]", scale) for joint, scale in given.items()
        }
    else:
        scales = dict.fromkeys(moving, real("action_scale", given))
    return [scales[joint] for joint in moving]
