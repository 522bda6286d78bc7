"""File format of policies: arrays and a JSON text in an ``.npz`` archive."""

import json
from collections.abc import Callable, Collection, Mapping, Sequence
from pathlib import Path
from typing import Any, TypeVar

import numpy as np

from ..common import npz
from . import checks

# Version of the format.
FORMAT = 1
# Kinds of policies. Files of learned policies of version 0.1 do not name theirs.
NETWORK, ORBIT = "network", "orbit"
# Names of a layer's arrays, numbered from 0: weight0, bias0, weight1 and so on.
LAYER = ("weight", "bias")
# Name of the text.
TEXT = "text"
# Limits on all arrays of a file [bytes]: four million numbers in single precision, and an orbit.
_MOST = {NETWORK: 16 * 2**20, ORBIT: 64 * 2**20}

Made = TypeVar("Made")
Headers = Mapping[str, npz.Header]
Layouts = dict[str, npz.Layout]


def write(path: Path, kind: str, arrays: Mapping[str, Any], text: Mapping[str, Any]) -> None:
    """Write a file atomically.

    Raises
    ------
    ValueError
        If the arrays exceed the limit of their kind.
    OSError
        If the file cannot be written.
    """
    total = sum(np.asarray(array).nbytes for array in arrays.values())
    if total > _MOST[kind]:
        raise ValueError(f"{total} bytes of arrays: at most {_MOST[kind]} are possible")
    encoded = json.dumps({"format": FORMAT, "kind": kind, **text}, allow_nan=False)
    npz.write(path, {**arrays, TEXT: np.array(encoded)})


def load(path: Path, makers: Mapping[str, Callable[..., Made]]) -> Made:
    """Read a file, and make its policy from its fields by the maker of its kind.

    Raises
    ------
    ValueError
        If it is damaged, of an unknown format or too large, a part is missing, unknown or wrong, or
        its kind is another one.
    OSError
        If it cannot be read.
    """
    try:
        kind, fields = _read(path)
        if kind not in makers:
            raise ValueError(f"of the kind {kind!r}, which skate_env.policies.load reads")
        return makers[kind](**fields)
    except (TypeError, ValueError) as error:
        raise ValueError(f"policy {path}: {error}") from None


def _read(path: Path) -> tuple[str, dict[str, Any]]:
    """Read a file: its kind and the fields of its policy, checked for names and shapes only."""
    kinds = []

    def check(headers: dict[str, npz.Header], text: dict[str, Any]) -> None:
        if text.pop("format", None) != FORMAT:
            raise ValueError(f"unknown format: this version reads format {FORMAT}")
        kind = text.pop("kind", NETWORK)
        if not isinstance(kind, str) or kind not in _LAYOUTS:
            raise ValueError(f"unknown kind: must be one of {', '.join(_LAYOUTS)}")
        checks.text(text)
        npz.check_arrays(headers, _LAYOUTS[kind](headers, text), _MOST[kind])
        kinds.append(kind)

    values, text = npz.read(path, TEXT, check)
    torques = values.pop("action_scale").tolist()
    text["action_scale"] = dict(zip(text["joint_names"], torques, strict=True))
    (kind,) = kinds
    if kind == NETWORK:
        pairs = _layer_names(values)
        text["layers"] = [tuple(values.pop(name) for name in pair) for pair in pairs]
    return kind, {**values, **text}


def inputs(names: Sequence[str]) -> list[int]:
    """Return what a feedback about an orbit reads: angles, the foot's velocity, rates."""
    known = list(names)
    angles = [i for i, name in enumerate(known) if name.startswith("angle.")]
    rates = [i for i, name in enumerate(known) if name.startswith("rate.")]
    return [*angles, known.index("slip.support"), known.index("rise.support"), *rates]


def _layer_names(names: Collection[str]) -> list[tuple[str, ...]]:
    count = sum(name.startswith(LAYER[0]) for name in names)
    return [tuple(f"{part}{i}" for part in LAYER) for i in range(count)]


def _of_network(headers: Headers, text: dict[str, Any]) -> Layouts:
    d, n = len(text["observation_names"]), len(text["joint_names"])
    layouts: Layouts = {
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
    return layouts


def _of_orbit(_: Headers, text: dict[str, Any]) -> Layouts:
    n, d = len(text["joint_names"]), len(inputs(text["observation_names"]))
    return {
        "references": ("f8", ("phases", d)),
        "actions": ("f4", ("phases", n)),
        "gains": ("f4", ("phases", n, d)),
        "roots": ("f4", ("phases", d, d)),
        "limit": ("f8", ()),
        "action_scale": ("f8", (n,)),
    }


_LAYOUTS: dict[str, Callable[[Headers, dict[str, Any]], Layouts]] = {
    NETWORK: _of_network,
    ORBIT: _of_orbit,
}
