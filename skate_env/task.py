"""What the single and the vector environment share: keywords, spaces, actions, options, infos."""

import json
from collections.abc import Mapping
from dataclasses import dataclass
from numbers import Real
from pathlib import Path
from typing import Any

import numpy as np
from gymnasium import spaces
from gymnasium.error import ResetNeeded
from gymnasium.vector import AutoresetMode
from numpy.typing import NDArray

from ._core import END_CAUSES, Batch, Scene
from .scenes import as_scene, replace

# Residual torque of a full action [N m]. The legs and the yaw have the largest amplitude that the
# paper prints for them (Eqs. 17 to 22). It prints none for the others: the supporting hip has that
# of the free hip, the trunk that of the yaw, and the light arms and the head have what moves them.
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

# What `Batch` gives as numbers.
_LEGS = np.array(["left", None, "right"], object)
_ENDS = np.array([None, *END_CAUSES], object)
_OPTIONS = ("state", "params", "phase", "perturb")
_STATE = ("q", "v", "support_leg")

Info = dict[str, Any]
Observation = NDArray[np.float32]
Space = spaces.Space[Observation]


@dataclass(frozen=True)
class Settings:
    """Keywords of an environment, checked; see `IceSkateEnv`."""

    scene: Scene
    action_scale: tuple[float, ...]
    torque_limit: float
    weights: tuple[float, float, float]
    perturb: float

    def batch(self, n: int, limit: int | None, autoreset: str, threads: int | None) -> Batch:
        """Make ``n`` episodes that wait for their first reset."""
        return Batch(
            self.scene,
            n,
            action_scale=list(self.action_scale),
            weights=self.weights,
            torque_limit=self.torque_limit,
            perturb=self.perturb,
            limit=limit,
            autoreset=autoreset,
            threads=threads,
        )


def settings(
    scene: Scene | str | Path,
    accuracy: str | float | Mapping[str, Any] | None,
    action_period: float | None,
    action_scale: float | Mapping[str, float] | None,
    torque_limit: float | None,
    weights: Mapping[str, float],
    perturb: float,
) -> Settings:
    """Check an environment's keywords.

    Raises
    ------
    TypeError, ValueError
        Name the keyword, what it is and what it must be.
    """
    scene = as_scene(scene)
    changes: dict[str, Any] = {}
    if accuracy is not None:
        changes["accuracy"] = accuracy
    if action_period is not None:
        changes["control.action_period"] = _real("action_period", action_period)
    scene = replace(scene, changes) if changes else scene
    slide, head, effort = (_real(name, weight) for name, weight in weights.items())
    return Settings(
        scene=scene,
        action_scale=_scales(scene, action_scale),
        torque_limit=np.inf if torque_limit is None else _real("torque_limit", torque_limit),
        weights=(slide, head, effort),
        perturb=_real("perturb", perturb),
    )


def joints(scene: Scene) -> list[str]:
    """Joints that an action moves, in order: those that the scene does not lock."""
    locked = json.loads(scene.to_json())["locked"]
    return [joint for joint in TORQUE_SCALE if joint not in locked]


def box_spaces(batch: Batch) -> tuple[Space, Space]:
    """Make the action and the observation space of one environment."""
    entries = batch.observation_entries()
    low, high = (np.array([entry[i] for entry in entries], np.float32) for i in (3, 4))
    action: Space = spaces.Box(-1.0, 1.0, (len(batch.joint_names),), np.float32)
    return action, spaces.Box(low, high, dtype=np.float32)


def checked(name: str, given: Any, shape: tuple[int, ...]) -> NDArray[np.float64]:
    """Take an array of finite real numbers of a shape.

    Raises
    ------
    TypeError
        If it does not consist of real numbers.
    ValueError
        If its shape is another, or a number is not finite.
    """
    try:
        array = np.asarray(given)
    except ValueError as error:
        raise ValueError(f"{name}: not an array of numbers: {error}") from None
    wanted = f"{' x '.join(map(str, shape))} real numbers"
    if array.dtype.kind not in "fiu":
        raise TypeError(f"{name} has dtype {array.dtype}: must be {wanted}")
    if array.shape != shape:
        raise ValueError(f"{name} has shape {array.shape}: must be {shape}")
    finite = np.isfinite(array)
    if not finite.all():
        bad = tuple(np.argwhere(~finite)[0].tolist())
        raise ValueError(f"{name}{list(bad)} = {array[bad]}: must be finite")
    return array.astype(np.float64)


def check_ready(batch: Batch) -> None:
    """Refuse a step of episodes that have not begun, or are over.

    Raises
    ------
    ResetNeeded
        It names the first of them.
    """
    if (waiting := batch.waiting()) is not None:
        i, over = waiting
        why = "its episode is over" if over else "it has not been reset"
        raise ResetNeeded(f"environment {i} cannot step: {why}; call reset first")


def seed_of(given: object) -> int | None:
    """Take a seed, or None.

    Raises
    ------
    TypeError, ValueError
        If it is neither None nor an int from 0 to 2**64 - 1.
    """
    if given is None:
        return None
    if isinstance(given, bool) or not isinstance(given, int | np.integer):
        raise TypeError(f"seed = {given!r}: must be an int or None, not {type(given).__name__}")
    if not 0 <= given < 2**64:
        raise ValueError(f"seed = {given}: must lie in [0, 2**64 - 1]")
    return int(given)


def count(name: str, given: object) -> int:
    """Take a whole number of at least 1.

    Raises
    ------
    TypeError, ValueError
        If it is none.
    """
    if isinstance(given, bool) or not isinstance(given, int | np.integer):
        raise TypeError(f"{name} = {given!r}: must be an int, not {type(given).__name__}")
    if given < 1:
        raise ValueError(f"{name} = {given}: must be at least 1")
    return int(given)


def autoreset(given: object) -> AutoresetMode:
    """Take an autoreset mode, or its name.

    Raises
    ------
    ValueError
        If it is none.
    """
    try:
        return AutoresetMode(given)
    except ValueError:
        known = ", ".join(repr(mode.value) for mode in AutoresetMode)
        raise ValueError(f"autoreset_mode = {given!r}: must be one of {known}") from None


def reset_mask(given: object, n: int) -> NDArray[np.bool_]:
    """Take ``options["reset_mask"]``, which environments to reset; None for all.

    Raises
    ------
    TypeError, ValueError
        If it is no array (n,) of bool, or all of it is false.
    """
    if given is None:
        return np.ones(n, np.bool_)
    if not isinstance(given, np.ndarray) or given.dtype != np.bool_:
        kind = given.dtype if isinstance(given, np.ndarray) else type(given).__name__
        raise TypeError(f"reset_mask: must be a numpy array of bool, not {kind}")
    if given.shape != (n,):
        raise ValueError(f"reset_mask has shape {given.shape}: must be ({n},)")
    if not given.any():
        raise ValueError("reset_mask names no environment: at least one must be true")
    return given


def elapsed_actions(given: object, n: int) -> list[int]:
    """Take ``options["elapsed"]``, how many actions count as made; None for none.

    Raises
    ------
    TypeError, ValueError
        If it is no array (n,) of int, or one of them is negative.
    """
    if given is None:
        return [0] * n
    array = np.asarray(given)
    if array.dtype.kind not in "iu":
        raise TypeError(f"elapsed has dtype {array.dtype}: must be {n} ints")
    if array.shape != (n,):
        raise ValueError(f"elapsed has shape {array.shape}: must be ({n},)")
    if (array < 0).any():
        raise ValueError(f"elapsed = {array.min()}: must be at least 0")
    return [int(x) for x in array]


def reset_arguments(options: Mapping[str, Any]) -> dict[str, Any]:
    """Turn the options of a reset into arguments of `Batch.reset`, which checks their values.

    Raises
    ------
    TypeError, ValueError
        If an option or a part of a state has an unknown name, or is no table where it must be.
    """
    _known("option", options, _OPTIONS)
    arguments = {name: value for name, value in options.items() if name != "state"}
    state = options.get("state")
    if state is None:
        return arguments
    if not isinstance(state, Mapping):
        raise TypeError(f"state = {state!r}: must be a dict of {', '.join(_STATE)}")
    _known("part of state", state, _STATE)
    return arguments | dict(state)


def single_info(columns: Mapping[str, NDArray[Any]]) -> Info:
    """Info of the only environment, as plain Python values."""
    info = {key: column[0].item() for key, column in columns.items()}
    info["support_leg"] = _LEGS[info["support_leg"] + 1]
    info["end_cause"] = _ENDS[info["end_cause"]]
    return info


def vector_info(
    columns: Mapping[str, NDArray[Any]], which: NDArray[np.bool_], places: Any = slice(None)
) -> Info:
    """Infos in Gymnasium's form: an array a key, and a mask ``_key`` of the environments it is of.

    Parameters
    ----------
    columns
        As `Batch` gives them, for the environments at ``places``.
    which
        Environments (n,) that the infos are of; the others have zeros and None.
    """
    info: Info = {}
    for key, column in columns.items():
        named = {"support_leg": (_LEGS, 1), "end_cause": (_ENDS, 0)}.get(key)
        if named:
            names, first = named
            column = names[column + first]
        values: NDArray[Any] = np.zeros(len(which), column.dtype)
        if column.dtype == object:
            values.fill(None)
        values[places] = column
        if not which.all():
            values[~which] = None if column.dtype == object else 0
        info[key], info[f"_{key}"] = values, which.copy()
    return info


def _scales(scene: Scene, given: float | Mapping[str, float] | None) -> tuple[float, ...]:
    moving = joints(scene)
    if given is None:
        scales = TORQUE_SCALE
    elif isinstance(given, Mapping):
        _known("joint in action_scale", given, moving)
        scales = TORQUE_SCALE | {
            joint: _real(f"action_scale[{joint!r}]", scale) for joint, scale in given.items()
        }
    else:
        scales = dict.fromkeys(moving, _real("action_scale", given))
    return tuple(scales[joint] for joint in moving)


def _known(what: str, given: Mapping[str, Any], known: Any) -> None:
    for name in given:
        if name not in known:
            raise ValueError(f"unknown {what} {name!r}: must be one of {', '.join(known)}")


def _real(name: str, given: Any) -> float:
    if isinstance(given, bool) or not isinstance(given, Real):
        raise TypeError(f"{name} = {given!r}: must be a real number, not {type(given).__name__}")
    return float(given)
