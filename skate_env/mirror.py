"""Left and right exchanged.

The robot is symmetric, so a mirrored state under mirrored actions makes the mirrored motion. The
joints of the legs are counted from the supporting foot and stay as they are, while the supporting
leg becomes the other one; the trunk's yaw and roll change their signs, the arms their places.
"""

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

# What becomes of the numbers that are not mirrored into themselves: yaw and roll, the arms.
_NEGATED = ("q8", "q10", "support_leg", "feedforward.tau8", "head_error.x")
_ARMS = {"q11": "q14", "q12": "q15", "q13": "q16"}
_SWAPPED = _ARMS | {left: right for right, left in _ARMS.items()}


class Mirror:
    """Mirrors vectors by the names of their numbers.

    Parameters
    ----------
    names
        Coordinates (`Simulator.coordinate_names`), joints (`IceSkateEnv.joint_names`), or numbers
        of an observation (`IceSkateEnv.observation_names`).

    Raises
    ------
    ValueError
        If a joint of one arm is among them, and that of the other is not.
    """

    def __init__(self, names: Sequence[str]) -> None:
        self._from = np.array([names.index(_partner(name)) for name in names])
        negated = [name in _NEGATED or name.split(".")[-1] in _NEGATED for name in names]
        self._sign = np.where(negated, -1.0, 1.0)

    def __call__(self, values: NDArray[np.floating]) -> NDArray[np.floating]:
        """Mirror vectors (..., n); twice gives them back."""
        mirrored = values[..., self._from] * self._sign
        return mirrored.astype(values.dtype)


def _partner(name: str) -> str:
    """Return the number whose mirror image a number is."""
    part, dot, joint = name.rpartition(".")
    return part + dot + _SWAPPED.get(joint, joint)
