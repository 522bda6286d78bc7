"""What the joints of a motion do: torques and rates.

Functions return NaN, or an empty dictionary, for a motion without a complete step.
"""

from collections.abc import Iterable

import numpy as np

from ..replay import Array
from .motion import Motion

ANKLES = ("q2", "q7")


def joints(motion: Motion) -> dict[str, int]:
    """Columns of the joints q1 to q17 that move."""
    names: list[str] = motion.recording.metadata["coordinate_names"]
    return {name: column for column, name in enumerate(names) if name.startswith("q")}


def peaks(motion: Motion, values: Array) -> dict[str, float]:
    """Largest magnitude of every joint's value (T, n) in the complete steps."""
    if not motion.shown.any():
        return {}
    largest = np.abs(values[motion.shown]).max(axis=0)
    return {name: float(largest[column]) for name, column in joints(motion).items()}


def torques(motion: Motion) -> dict[str, float]:
    """Largest total torque of every joint [N m]."""
    return peaks(motion, motion.recording.torque)


def largest(peaks: dict[str, float], names: Iterable[str] | None = None) -> float:
    """Largest of some values, or of all; NaN for none."""
    chosen = peaks if names is None else names
    return max((peaks[name] for name in chosen if name in peaks), default=np.nan)
