"""File format of policies: arrays and a JSON text in an ``.npz`` archive."""

import json
import zipfile
from collections.abc import Mapping
from io import BytesIO
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

# Version of the format.
FORMAT = 1
# Names of a layer's arrays, numbered from 0: weight0, bias0, weight1 and so on.
LAYER = ("weight", "bias")
_ARRAYS = ("log_std", "mean", "std", "clip", "action_scale")
_TEXTS = ("scene", "observation_names", "joint_names", "about")


def write(path: Path, arrays: Mapping[str, Any], text: Mapping[str, Any]) -> None:
    """Write a file; raise OSError if that fails."""
    said = json.dumps({"format": FORMAT, **text}, allow_nan=False)
    # Opened here, because NumPy appends a missing suffix to a path.
    with path.open("wb") as file:
        np.savez_compressed(file, **arrays, text=np.array(said))


def read(path: Path) -> dict[str, Any]:
    """Read a file: arrays and the text's fields by name, layers as a list of pairs of arrays.

    Raises
    ------
    ValueError
        If it is damaged or of an unknown format, or a part is missing or unknown.
    OSError
        If it cannot be read.
    """
    data = path.read_bytes()
    try:
        values = _unpacked(data)
        text = _parsed(values.pop("text", None))
        count = sum(name.startswith(LAYER[0]) for name in values)
        names = [tuple(f"{part}{i}" for part in LAYER) for i in range(count)]
        _check("array", values, (*_ARRAYS, *(name for pair in names for name in pair)))
        _check("part of the text", text, _TEXTS)
    except ValueError as error:
        raise ValueError(f"policy {path}: {error}") from None
    layers = [tuple(values.pop(name) for name in pair) for pair in names]
    return {"layers": layers, **values, **text}


def _unpacked(data: bytes) -> dict[str, NDArray[Any]]:
    if not zipfile.is_zipfile(BytesIO(data)):
        raise ValueError("not an .npz file")
    try:
        with np.load(BytesIO(data), allow_pickle=False) as file:
            return dict(file)
    # Damaged archives raise many kinds of exceptions.
    except Exception as error:
        raise ValueError(f"damaged: {error}") from None


def _parsed(text: NDArray[Any] | None) -> dict[str, Any]:
    try:
        parsed = json.loads(str(text))
    except (ValueError, RecursionError) as error:
        raise ValueError(f"its text is not JSON: {error}") from None
    if not isinstance(parsed, dict) or parsed.pop("format", None) != FORMAT:
        raise ValueError(f"unknown format: this version reads format {FORMAT}")
    return parsed


def _check(what: str, given: Mapping[str, Any], names: tuple[str, ...]) -> None:
    for name in names:
        if name not in given:
            raise ValueError(f"{what} {name!r} is missing")
    for name in given:
        if name not in names:
            raise ValueError(f"unknown {what} {name!r}")
