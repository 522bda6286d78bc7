"""File format of policies: arrays and a JSON text in an ``.npz`` archive."""

import json
from collections.abc import Collection, Mapping
from pathlib import Path
from typing import Any

import numpy as np

from ..common import npz
from . import checks

# Version of the format.
FORMAT = 1
# Names of a layer's arrays, numbered from 0: weight0, bias0, weight1 and so on.
LAYER = ("weight", "bias")
# Name of the text.
TEXT = "text"
# Limit on all arrays [bytes]: four million numbers in single precision.
_MOST = 16 * 2**20


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


def _layer_names(names: Collection[str]) -> list[tuple[str, ...]]:
    count = sum(name.startswith(LAYER[0]) for name in names)
    return [tuple(f"{part}{i}" for part in LAYER) for i in range(count)]


def _check_all(headers: dict[str, npz.Header], text: dict[str, Any]) -> None:
    if text.pop("format", None) != FORMAT:
        raise ValueError(f"unknown format: this version reads format {FORMAT}")
    checks.text(text)
    d, n = len(text["observation_names"]), len(text["joint_names"])
    layouts: dict[str, npz.Layout] = {
        "log_std": ("f4", (n,)),
        "mean": ("f8", (d,)),
        "std": ("f8", (d,)),
        "clip": ("f8", ()),
        "action_scale": ("f8", (n,)),
    }
    pairs = _layer_names(headers)
    widths: list[int | str] = [d, *(f"width of layer {i}" for i in range(len(pairs) - 1)), n]
    for (weight, bias), before, after in zip(pairs, widths, widths[1:], strict=False):
        layouts |= {weight: ("f4", (after, before)), bias: ("f4", (after,))}
    npz.check_arrays(headers, layouts, _MOST)
