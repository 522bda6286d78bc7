"""Recordings of simulations: sampled motion, events, and one row per step, and their files."""

import json
import math
from collections.abc import Mapping
from dataclasses import dataclass, fields
from pathlib import Path
from types import NoneType
from typing import Any

import numpy as np
from numpy.typing import NDArray

from .._core import Scene, Simulator
from ..common import files, finite, npz, real, shown, table
from . import page
from .receipt import Verification, verify

Array = NDArray[np.float64]

# Columns of the table of steps, with their units; `Simulator.take_steps` describes them.
STEP_UNITS = {
    "time": "s",
    "period": "s",
    "slide": "m",
    "loaded_slide": "m",
    "progress": "m",
    "lowest_head": "m",
    "deepest_toe": "m",
    "inadmissible_time": "s",
}
STEP = np.dtype([(name, "f8") for name in STEP_UNITS])
EVENT = np.dtype(
    [("time", "f8"), ("what", "U48"), ("before", "i8"), ("after", "i8"), ("support_leg", "U5")]
)

# Types and shapes of the arrays in a file; T, n, E and S as in `Recording`.
_ARRAYS: dict[str, npz.Layout] = {
    "t": ("f8", ("T",)),
    "q": ("f8", ("T", "n")),
    "v": ("f8", ("T", "n")),
    "acceleration": ("f8", ("T", "n")),
    "torque": ("f8", ("T", "n")),
    "state_number": ("i8", ("T",)),
    "right_support": ("?", ("T",)),
    "contact_forces": ("f8", ("T", 2, 4)),
    "head": ("f8", ("T", 3)),
    "segments": ("f4", ("T", 17, 2, 3)),
    "events": (EVENT, ("E",)),
    "steps": (STEP, ("S",)),
    "start": ("u1", ("B",)),
    "actions": ("f8", ("A", "joints")),
}
_METADATA = (
    *("scene", "coordinate_names", "policy", "termination"),
    *("wall_time", "stats", "totals", "version", "checksum"),
)
# Types of metadata that are no numbers.
_TYPES = {
    **dict.fromkeys(("scene", "version", "checksum"), (str,)),
    "policy": (dict, NoneType),
    "termination": (str, NoneType),
}
# Limit on all arrays [bytes]: 10 hours at the usual action period.
_MOST = 8 * 2**30


@dataclass(frozen=True)
class Recording:
    """T samples of a motion with n coordinates, E events and S completed steps.

    Attributes
    ----------
    t
        Time (T,) [s]; the first sample is the start.
    q, v, acceleration
        Coordinates (T, n) [m, rad] and their first and second rates.
    torque
        Generalised torque (T, n) [N, N m], baseline plus residual.
    state_number
        Row of Table 2 (T,), 0 with both feet off the ice.
    right_support
        Whether the right leg supports (T,).
    contact_forces
        (T, 2, 4): supporting and free foot; f_y, N, N at the heel, N at the toe [N].
    head
        Top of the head (T, 3) in the world [m].
    segments
        Both ends of the 17 links (T, 17, 2, 3) in the world [m]; single precision, for drawing.
    events
        Structured (E,): time [s], what, state before, state after, supporting leg.
    steps
        Structured (S,), columns as in `STEP_UNITS`.
    start
        Snapshot of the simulator at the start (B,) [bytes].
    actions
        Residual torque (A, joints) of each action [N m]; zero without a policy.
    metadata
        `scene` (TOML), `coordinate_names`, `policy` (its `about`, None without
        one), `termination` (None if all steps were made), `wall_time` spent in the engine [s],
        `stats` and `totals` as `Simulator` gives them, `version` of skate-env, `checksum`
        (SHA-256 of t, q and v at the start and after each action, little-endian).

    Examples
    --------
    >>> import skate_env
    >>> recording = skate_env.replay.record(skate_env.Simulator("paper"), steps=2)
    >>> len(recording.steps), recording.contact_forces.shape[1:]
    (2, (2, 4))
    """

    t: Array
    q: Array
    v: Array
    acceleration: Array
    torque: Array
    state_number: NDArray[np.int64]
    right_support: NDArray[np.bool_]
    contact_forces: Array
    head: Array
    segments: NDArray[np.float32]
    events: NDArray[np.void]
    steps: NDArray[np.void]
    start: NDArray[np.uint8]
    actions: Array
    metadata: dict[str, Any]

    @property
    def scene(self) -> Scene:
        """The scene that was simulated."""
        return Scene.from_toml(self.metadata["scene"])

    def index(self, coordinate: str) -> int | None:
        """Return the column of a coordinate in `q`, or None if the scene locks it."""
        names: list[str] = self.metadata["coordinate_names"]
        return names.index(coordinate) if coordinate in names else None

    def swaps(self) -> NDArray[np.int64]:
        """Return the rows of `events` with leg swaps."""
        right = self.events["support_leg"] == "right"
        before = np.concatenate([self.right_support[:1], right[:-1]])
        return np.flatnonzero(right != before)

    def state_sequence(self) -> list[int]:
        """Return the contact states of the last full cycle, from one leg swap to the next.

        The first cycle begins at the start; without a leg swap the list is empty. Events that do
        not change the state's number are omitted.
        """
        swaps = self.swaps()
        if swaps.size == 0:
            return []
        first = swaps[-2] if swaps.size > 1 else -1
        cycle = self.events["after"][first + 1 : swaps[-1]].tolist()
        begins = self.events["after"][first] if swaps.size > 1 else self.state_number[0]
        states = [int(begins)]
        for state in cycle:
            if state != states[-1]:
                states.append(state)
        return states

    def save(self, path: Path) -> None:
        """Write all fields to a compressed ``.npz`` file, atomically; `load` reads it back."""
        values = {field.name: getattr(self, field.name) for field in fields(self)}
        values["metadata"] = np.array(json.dumps(self.metadata))
        npz.write(path, values)

    @classmethod
    def load(cls, path: str | Path) -> "Recording":
        """Read a file of `save`.

        Raises
        ------
        ValueError
            If the file is damaged, or holds no recording; the message names the part.
        OSError
            If the file cannot be read.
        """
        path = Path(path)
        try:
            values, metadata = npz.read(path, "metadata", _check_headers)
            _check_values(values)
        except ValueError as error:
            raise ValueError(f"recording {path}: {error}") from None
        return cls(metadata=metadata, **values)

    def verify(self) -> Verification:
        """Repeat the motion from its start with its actions, and compare it bit for bit.

        Raises
        ------
        ValueError
            If this version cannot restore the start.
        """
        return verify(self)

    def _repr_html_(self) -> str:
        """Return a player for notebooks, or a sentence where the page is not installed."""
        return page.element(vars(self))

    def packed(self) -> bytes:
        """Return what the page in the browser shows; errors as of `page.packed`."""
        return page.packed(vars(self))

    def to_html(self) -> str:
        """Return a page that plays the recording without other files and without a network.

        Raises
        ------
        OSError
            If the page is missing in this installation.
        ValueError
            If the recording is too long for the page.
        """
        return page.player(self.packed())

    def save_steps(self, path: Path) -> None:
        """Write the table of steps as CSV, with units in the header."""
        header = ["step", *(f"{name} [{unit}]" for name, unit in STEP_UNITS.items())]
        rows = [[i, *row] for i, row in enumerate(self.steps.tolist(), start=1)]
        files.write_csv(path, [header, *rows])


def _check_headers(headers: dict[str, npz.Header], metadata: dict[str, Any]) -> None:
    """Check the metadata, and names, types and shapes of the arrays.

    Raises
    ------
    TypeError, ValueError
        If something is missing, unknown or invalid; the message names it.
    """
    for name in _METADATA:
        if name not in metadata:
            raise ValueError(f"metadata {name!r} is missing")
    numbers = {"wall_time": metadata["wall_time"]}
    for name in ("stats", "totals"):
        given = table(f"metadata {name}", metadata[name])
        numbers |= {f"{name}.{key}": value for key, value in given.items()}
    for name, value in numbers.items():
        if not math.isfinite(real(f"metadata {name}", value)):
            raise ValueError(f"metadata {name} = {value}: must be finite")
    for name, kinds in _TYPES.items():
        value = metadata[name]
        if not isinstance(value, kinds):
            wanted = " or ".join(kind.__name__ for kind in kinds)
            raise TypeError(f"metadata {name} = {shown(value)}: must be {wanted}")
    try:
        names = Simulator(Scene.from_toml(metadata["scene"])).coordinate_names
    except ValueError as error:
        raise ValueError(f"metadata scene: {error}") from None
    if metadata["coordinate_names"] != names:
        raise ValueError(
            f"metadata coordinate_names = {shown(metadata['coordinate_names'])}: "
            f"those of the scene are {names}"
        )
    lengths = npz.check_arrays(headers, _ARRAYS, _MOST)
    if not lengths["T"]:
        raise ValueError("t: no samples")
    if lengths["n"] != len(names):
        raise ValueError(f"q: {lengths['n']} columns: the scene has {len(names)} coordinates")
    if lengths["joints"] != len(names) - 3:
        raise ValueError(f"actions: {lengths['joints']} columns: not one for each joint")


def _check_values(values: Mapping[str, NDArray[Any]]) -> None:
    """Check that all numbers are finite, and that t increases."""
    for name, array in values.items():
        for column in array.dtype.names or ("",):
            numbers = array[column] if column else array
            if numbers.dtype.kind == "f":
                finite(f"{name} {column}".strip(), numbers, numbers.shape)
    if (np.diff(values["t"]) < 0.0).any():
        raise ValueError("t: must increase")
