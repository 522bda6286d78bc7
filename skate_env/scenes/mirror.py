"""Mirror symmetry: exchange of left and right.

The robot is symmetric, so a mirrored state under mirrored actions makes the mirrored motion. The
supporting leg changes. Joints of the legs are numbered from the supporting foot and do not change;
yaw and roll of the trunk change sign; the arms are exchanged.
"""

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

# Names of elements that change sign, and exchanged joints of the arms.
_NEGATED = ("q8", "q10", "support_leg", "feedforward.tau8", "head_error.x")
_ARMS = {"q11": "q14", "q12": "q15", "q13": "q16"}
_SWAPPED = _ARMS | {left: right for right, left in _ARMS.items()}


class Mirror:
    """Mirrors vectors by the names of their elements.

    Parameters
    ----------
    names
        Coordinates (`Simulator.coordinate_names`), joints (`IceSkateEnv.joint_names`), or numbers
        of an observation (`IceSkateEnv.observation_names`).

    Raises
    ------
    TypeError
        If the names are not a sequence of strings.
    ValueError
        If there is no name, or the names contain a joint of one arm only.

    Examples
    --------
    >>> import numpy as np
    >>> import skate_env
    >>> skate_env.Mirror(["q8", "q11", "q14"])(np.array([0.1, 1.0, 2.0]))
    array([-0.1,  2. ,  1. ])
    """

    def __init__(self, names: Sequence[str]) -> None:
        is_list = isinstance(names, Sequence) and not isinstance(names, str)
        if not is_list or not all(isinstance(name, str) for name in names):
            raise TypeError("names: must be a list of names")
        if not names:
            raise ValueError("names: must have at least one name")
        self._from = np.array([names.index(_partner(name)) for name in names])
        negated = [name in _NEGATED or name.split(".")[-1] in _NEGATED for name in names]
        self._sign = np.where(negated, -1.0, 1.0)

    def __call__(self, values: NDArray[np.floating]) -> NDArray[np.floating]:
        """Mirror vectors (..., n); mirroring twice is the identity.

        Raises
        ------
        TypeError, ValueError
            If the values are no array of floating-point numbers, or have another shape.
        """
        if not isinstance(values, np.ndarray) or values.dtype.kind != "f":
            raise TypeError("values: must be an array of floating-point numbers")
        if values.shape[-1:] != self._sign.shape:
            raise ValueError(f"values have shape {values.shape}: must be (..., {self._sign.size})")
        mirrored = values[..., self._from] * self._sign
        return mirrored.astype(values.dtype)


def _partner(name: str) -> str:
    """Return the name of the mirror image of an element."""
    part, dot, joint = name.rpartition(".")
    return part + dot + _SWAPPED.get(joint, joint)
