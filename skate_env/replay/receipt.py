"""Receipts: what repeats the motion of a recording, and whether it does, bit for bit."""

import hashlib
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from .._core import Simulator

if TYPE_CHECKING:
    from .recording import Recording


class Receipt:
    """Start, actions and checksum of a motion, gathered while it is simulated.

    Parameters
    ----------
    sim
        Simulator at the start of the motion.
    """

    def __init__(self, sim: Simulator) -> None:
        self._start = np.frombuffer(sim.snapshot(), dtype=np.uint8)
        self._none = np.zeros(len(sim.coordinate_names) - 3)
        self._actions: list[NDArray[np.float64]] = []
        self._checksum = hashlib.sha256(_state(sim))

    def add(self, residual: NDArray[np.float64] | None, sim: Simulator) -> None:
        """Add an action [N m], None for no residual, and the state that it leads to."""
        self._actions.append(self._none if residual is None else np.array(residual, dtype=float))
        self._checksum.update(_state(sim))

    def fields(self) -> dict[str, NDArray[Any]]:
        """Return the fields `start` and `actions` of `Recording`."""
        return {"start": self._start, "actions": np.reshape(self._actions, (-1, len(self._none)))}

    def checksum(self) -> str:
        """Return the SHA-256 of t, q and v at the start and after each action."""
        return self._checksum.hexdigest()


@dataclass(frozen=True)
class Verification:
    """Result of `verify`."""

    actions: int
    """Number of actions that were repeated."""
    duration: float
    """Their simulated time [s]."""
    difference: str | None
    """The first difference, None if the motion is repeated bit for bit."""


def verify(recording: "Recording") -> Verification:
    """Repeat a recorded motion from its start with its actions; compare t, q and v.

    Raises
    ------
    ValueError
        If the start is not a snapshot of the recorded scene, as with one of another version.
    """
    sim = Simulator(recording.scene)
    sim.restore(recording.start.tobytes())
    begin, receipt = sim.time, Receipt(sim)
    difference = _difference(recording, sim)
    made = 0
    for action in recording.actions:
        if difference is not None or sim.termination is not None:
            break
        sim.step(action)
        receipt.add(action, sim)
        made += 1
        difference = _difference(recording, sim)
    if difference is None and receipt.checksum() != recording.metadata["checksum"]:
        difference = f"the checksum of {made} actions (recorded {len(recording.actions)})"
    return Verification(made, sim.time - begin, difference)


def _state(sim: Simulator) -> bytes:
    """Return t, q and v, little-endian."""
    return np.concatenate([[sim.time], sim.q, sim.v]).astype("<f8").tobytes()


def _difference(recording: "Recording", sim: Simulator) -> str | None:
    """Compare with the sample at this time, if there is one; samples may be rare or dense."""
    row = int(np.searchsorted(recording.t, sim.time))
    if row == len(recording.t) or recording.t[row] != sim.time:
        return None
    for what, known, own in (("", recording.q[row], sim.q), ("rate of ", recording.v[row], sim.v)):
        for i in np.flatnonzero(known != own):
            name = sim.coordinate_names[i]
            return f"{what}{name} at {sim.time:.6g} s: recorded {known[i]}, now {own[i]}"
    return None
