"""File format of policies: arrays and a JSON text in an ``.npz`` archive."""

import json
from collections.abc import Iterable, Mapping
from pathlib import Path
from typing import Any

import numpy as np

from . import npz

# Version of the format.
FORMAT = 1
# Names of a layer's arrays, numbered from 0: weight0, bias0, weight1 and so on.
LAYER = ("weight", "bias")
_ARRAYS = ("log_std", "mean", "std", "clip", "action_scale")
# Name of the text.
TEXT = "text"
# Limit on all arrays [bytes]: four million numbers in single precision.
_MOST = 16 * 2**20
_TEXTS = ("scene", "observation_names", "joint_names", "about")


def write(path: Path, arrays: Mapping[str, Any], text: Mapping[str, Any]) -> None:
    """Write a file atomically.

    Raises
    ------
    ValueError
        If the arrays exceed the limit of `read`.
    OSError
        If the file cannot be written.
    """
    total = sum(np.asarray(array).nbytes for array in arrays.values())
    if total > _MOST:
        raise ValueError(f"{total} bytes of arrays: at most {_MOST} are possible")
    said = json.dumps({"format": FORMAT, **text}, allow_nan=False)
    npz.write(path, {**arrays, TEXT: np.array(said)})


def read(path: Path) -> dict[str, Any]:
    """Read a file: arrays and the text's fields by name, layers as a list of pairs of arrays.

    Raises
    ------
    ValueError
        If it is damaged, of an unknown format or too large, or a part is missing or unknown.
    OSError
        If it cannot be read.
    """
    try:
        values, text = npz.read(path, TEXT, _check_all)
    except ValueError as error:
        raise ValueError(f"policy {path}: {error}") from None
    pairs = _layer_names(values)
    layers = [tuple(values.pop(name) for name in pair) for pair in pairs]
    return {"layers": layers, **values, **text}


def _layer_names(names: Iterable[str]) -> list[tuple[str, ...]]:
    count = sum(name.startswith(LAYER[0]) for name in names)
    return [tuple(f"{part}{i}" for part in LAYER) for i in range(count)]


def _check_all(headers: dict[str, npz.Header], text: dict[str, Any]) -> None:
    if text.pop("format", None) != FORMAT:
        raise ValueError(f"unknown format: this version reads format {FORMAT}")
    check_names("part of the text", text, _TEXTS)
    names = (name for pair in _layer_names(headers) for name in pair)
    check_names("array", headers, (*_ARRAYS, *names))
    npz.check_size(headers, _MOST)


def check_names(what: str, given: Mapping[str, Any], names: tuple[str, ...]) -> None:
    """Check that a mapping has exactly these names; raise ValueError."""
    for name in names:
        if name not in given:
            raise ValueError(f"{what} {name!r} is missing")
    for name in given:
        if name not in names:
            raise ValueError(f"unknown {what} {name!r}")
