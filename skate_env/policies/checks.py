"""Parts of policies: their environment, and the validation of what they get.

Each check raises TypeError or ValueError with the reason.
"""

import json
from collections.abc import Mapping, Sequence
from itertools import zip_longest
from typing import Any

import numpy as np
from numpy.typing import NDArray

from .._core import Scene
from ..common import (
    array_of,
    between,
    check_names,
    checked,
    finite,
    items,
    known,
    real,
    shown,
    table,
)
from ..environments import IceSkateEnv, joints

Array = NDArray[np.float64]
Layer = tuple[NDArray[np.float32], NDArray[np.float32]]
Shape = tuple[int | str, ...]

# Within these bounds no sum in the network overflows float32, so actions are finite for any file.
MOST = 1e6
# Parts of the text in a policy's file.
TEXTS = ("scene", "observation_names", "joint_names", "about")


def parts(
    scene: Scene,
    action_scale: Any,
    observation_names: Sequence[str],
    joint_names: Sequence[str],
    about: Mapping[str, Any],
) -> dict[str, Any]:
    """Check what every policy has against its scene; return it as a policy keeps it."""
    if not isinstance(scene, Scene):
        raise TypeError(f"scene = {shown(scene)}: must be a Scene, not {type(scene).__name__}")
    names("joint_names", joint_names, joints(scene), scene)
    scale = torques(action_scale, joint_names)
    seen = IceSkateEnv(**environment(scene, scale)).observation_names
    names("observation_names", observation_names, seen, scene)
    return {
        "action_scale": scale,
        "observation_names": tuple(observation_names),
        "joint_names": tuple(joint_names),
        "about": plain(about),
    }


def text(given: dict[str, Any]) -> None:
    """Check the text of a policy's file, before its arrays are read; its scene becomes a `Scene`.

    No part may be missing or unknown; names and scene must match.
    """
    check_names("part of the text", given, TEXTS)
    scene = given["scene"] = Scene.from_toml(given["scene"])
    scale = dict.fromkeys(joints(scene), 1.0)
    parts(action_scale=scale, **given)


def torques(given: Any, joints: Sequence[str]) -> dict[str, float]:
    """Check that every joint has a torque; return the torques in the order of the joints."""
    scale = table("action_scale", given)
    known("joint in action_scale", scale, joints)
    for joint in joints:
        if joint not in scale:
            raise ValueError(f"action_scale: {joint!r} is missing")
    return {joint: real(f"action_scale[{joint!r}]", scale[joint]) for joint in joints}


def environment(
    scene: Scene, action_scale: Mapping[str, float], randomise: bool = False
) -> dict[str, Any]:
    """Return the keywords of `Residual.environment`."""
    fields = json.loads(scene.to_json())
    if not randomise:
        del fields["randomise"]
    return {
        "scene": fields,
        "action_period": scene.get("control.action_period"),
        "joints": "all",
        "action_scale": dict(action_scale),
        # Policies mirror by themselves.
        "mirrored": False,
    }


def observations(given: Any, d: int) -> Array:
    """Check one observation (d,) or many (n, d)."""
    array = array_of("observation", given)
    return checked("observation", array, (*array.shape[:-1], d))


def layers(given: Any, d: int, n: int) -> tuple[Layer, ...]:
    """Check that the layers map an observation (d,) to an action (n,)."""
    pairs = [items("layers", layer) for layer in items("layers", given)]
    if not pairs or any(len(pair) != 2 for pair in pairs):
        raise ValueError("layers: must be one or more pairs of weight and bias")
    found, width = [], d
    for i, (weight, bias) in enumerate(pairs):
        out = n if i == len(pairs) - 1 else max(array_of(f"bias{i}", bias).size, 1)
        limits = (-MOST, MOST)
        found.append(
            (
                single(f"weight{i}", weight, (out, width), *limits),
                single(f"bias{i}", bias, (out,), *limits),
            )
        )
        width = out
    return tuple(found)


def names(what: str, given: Any, wanted: Sequence[str], scene: Scene) -> None:
    """Check that names are those of the environments of a scene."""
    if isinstance(given, str) or not isinstance(given, Sequence):
        raise TypeError(f"{what} = {shown(given)}: must be a list of names")
    for i, (name, there) in enumerate(zip_longest(given, wanted)):
        if name != there:
            raise ValueError(
                f"{what}[{i}] is {shown(name)}: in environments of the scene {scene.name!r} "
                f"it is {there!r}"
            )


def plain(about: Any) -> dict[str, Any]:
    """Copy the training data of a policy as JSON values."""
    try:
        plain: dict[str, Any] = json.loads(json.dumps(table("about", about), allow_nan=False))
    except RecursionError:
        raise ValueError("about: nested too deeply") from None
    except (TypeError, ValueError) as error:
        raise type(error)(f"about: not for JSON: {error}") from None
    return plain


def scalar(name: str, given: Any, low: float, high: float) -> float:
    """Check a number, also one in an array as of a file."""
    return between(name, array_of(name, given)[()], low, high)


def numbers(name: str, given: Any, shape: Shape, low: float, high: float) -> Array:
    """Check an array's shape and the range of its numbers."""
    return _within(name, given, shape, low, high).astype(np.float64, order="C")


def single(name: str, given: Any, shape: Shape, low: float, high: float) -> NDArray[np.float32]:
    """Check as `numbers` does, and round to single precision."""
    array = _within(name, given, shape, low, high)
    with np.errstate(under="ignore"):
        return array.astype(np.float32, order="C")


def _within(name: str, given: Any, shape: Shape, low: float, high: float) -> NDArray[Any]:
    array = finite(name, given, shape)
    # Compared in double precision, which half precision does not imply.
    outside = np.argwhere((array < np.float64(low)) | (array > np.float64(high)))
    if len(outside):
        place = tuple(outside[0].tolist())
        raise ValueError(f"{name}{list(place)} = {array[place]}: must lie in [{low:g}, {high:g}]")
    return array
