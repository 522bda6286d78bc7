"""Scenes: presets of the package, scene files, and modified copies of them."""

import json
import math
from collections.abc import Mapping
from importlib import resources
from pathlib import Path
from typing import Any, TypeAlias

from .._core import Scene
from ..common import read_text, shown

_FOLDER = resources.files(__package__)
SceneSource: TypeAlias = Scene | str | Path | Mapping[str, Any]
"""A scene, a preset's name, the path of a scene file, or a table of fields as in JSON."""

# Presets whose names have changed.
_RENAMED = {"paper_long_blade": "paper_printed", "unilateral": "push_only"}
# Limit on a scene file [bytes]; the presets have 4 kB.
_MOST = 2**20


def scene_names() -> list[str]:
    """Names of the presets that come with the package, sorted.

    Examples
    --------
    >>> import skate_env
    >>> skate_env.scene_names()
    ['paper', 'paper_arms', 'paper_printed', 'push_only']
    """
    files = (file.name for file in _FOLDER.iterdir())
    return sorted(name.removesuffix(".toml") for name in files if name.endswith(".toml"))


def load_scene(name_or_path: str | Path) -> Scene:
    """Read a preset by its name, or a scene file by its path (which ends in ``.toml``).

    Raises
    ------
    TypeError
        If it is neither a name nor a path.
    ValueError
        If there is no preset of that name, or the file is not a valid scene of at most 1 MB.
    OSError
        If the file cannot be read.

    Examples
    --------
    >>> import skate_env
    >>> skate_env.load_scene("paper").get("fall.head_height")
    1.0
    """
    if not isinstance(name_or_path, str | Path):
        raise TypeError(
            f"scene {shown(name_or_path)}: must be a preset's name or a path, "
            f"not {type(name_or_path).__name__}"
        )
    if str(name_or_path).endswith(".toml"):
        try:
            text = read_text(Path(name_or_path), _MOST)
        except ValueError as error:
            raise ValueError(f"scene {str(name_or_path)!r}: {error}") from None
    elif name_or_path in scene_names():
        text = (_FOLDER / f"{name_or_path}.toml").read_text(encoding="utf-8")
    else:
        known = ", ".join(scene_names())
        if name_or_path in _RENAMED:
            new = _RENAMED[str(name_or_path)]
            raise ValueError(f"no scene {str(name_or_path)!r}: its name is {new!r} now")
        raise ValueError(
            f"no scene {str(name_or_path)!r}: name one of {known}, or the path of a .toml file"
        )
    try:
        return Scene.from_toml(text)
    except ValueError as error:
        raise ValueError(f"scene {name_or_path}: {error}") from None


def as_scene(scene: SceneSource) -> Scene:
    """Return a scene unchanged, make it from a table, or load it as `load_scene` does.

    Raises
    ------
    TypeError, ValueError
        If a field of a table is unknown or its value not valid; missing fields have their defaults.
        Others as for `load_scene`.
    OSError
        If a file cannot be read.
    """
    if not isinstance(scene, Mapping):
        return scene if isinstance(scene, Scene) else load_scene(scene)
    for name, value in scene.items():
        _check(name, value)
    return Scene.from_json(json.dumps(dict(scene)))


def replace(scene: SceneSource, changes: Mapping[str, Any]) -> Scene:
    """Copy a scene with some fields changed.

    Parameters
    ----------
    scene
        A `Scene`, which is not modified, a preset's name, the path of a scene file, or a table.
    changes
        New values by dotted name, for example ``{"ice.friction.mu_forward": 0.3}``. A table
        replaces the whole table, None switches an optional effect off.

    Raises
    ------
    TypeError
        If ``changes`` is not a mapping, a name is no text, or a value is neither a number nor text,
        list, table or None.
    ValueError
        If a name is unknown (the message lists the valid ones) or a value out of range.

    Examples
    --------
    >>> from skate_env.scenes import replace
    >>> replace("paper", {"accuracy": 1e-8}).get("accuracy")
    1e-08
    """
    if not isinstance(changes, Mapping):
        raise TypeError(f"changes: must be a mapping, not {type(changes).__name__}")
    fields: dict[str, Any] = json.loads(as_scene(scene).to_json())
    for name, value in changes.items():
        _check(name, value)
        *path, last = name.split(".")
        table = fields
        for key in path:
            # A table that is absent or None is an effect that is off: naming its field turns it on.
            if table.get(key) is None:
                table[key] = {}
            table = table[key]
            if not isinstance(table, dict):
                raise ValueError(f"{name}: {key} is a value, not a table of fields")
        table[last] = value
    return Scene.from_json(json.dumps(fields))


def _within_float(digits: str) -> float:
    """Convert an integer of a JSON text; raise ValueError where a float cannot hold it."""
    number = float(digits)
    if not math.isfinite(number):
        raise ValueError("too large")
    return number


def _check(name: object, value: object) -> None:
    """Check that a value can be stored in a scene file; errors name the field."""
    if not isinstance(name, str):
        raise TypeError(f"field {shown(name)}: its name must be a str, not {type(name).__name__}")
    try:
        json.loads(json.dumps(value, allow_nan=False), parse_int=_within_float)
    except TypeError as error:
        raise TypeError(f"{name} = {shown(value)}: {error}") from None
    except RecursionError:
        raise ValueError(f"{name}: nested too deeply") from None
    except ValueError:
        raise ValueError(f"{name} = {shown(value)}: must be finite") from None
