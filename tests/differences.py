"""Differences of high order of a motion with events, with an estimate of their error.

The error of a difference has two parts: truncation, which the difference between two orders
estimates, and noise, by which two motions differ whatever the step.
"""

from collections.abc import Callable, Hashable, Sequence

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]
Value = Callable[[float], tuple[Array, Hashable]]

STEPS = [4e-3 * 4.0**-k for k in range(8)]
"""Steps along a direction, largest first."""
NOISE = 1e-11
"""Largest violation of a constraint that the engine does not correct [m, m/s]."""


def _weights(offsets: Sequence[int]) -> Array:
    """Weights of the values at these offsets for the derivative at 0, exact for polynomials."""
    powers = np.vander(np.array(offsets, dtype=float), increasing=True).T
    return np.linalg.solve(powers, np.eye(len(offsets))[1])


# Central, forward and backward: where a larger displacement to one side changes the sequence of
# events, the points on the other side remain.
_STENCILS = [
    [(offsets, _weights(offsets)) for offsets in pair]
    for pair in (
        (tuple(range(-4, 5)), tuple(range(-3, 4))),
        (tuple(range(8)), tuple(range(7))),
        (tuple(range(-7, 1)), tuple(range(-6, 1))),
    )
]


def difference(
    value: Value, steps: Sequence[float] = STEPS, noise: float = NOISE
) -> tuple[Array, float] | None:
    """Differentiate ``value(e)`` at 0; return the derivative and its error.

    ``value`` returns an array and the sequence of events. Of all steps, largest first, and all
    stencils whose points have the sequence of the middle, the one with the smallest error counts.
    None if there is none.
    """
    known, best = value(0.0), None
    for step in steps:
        if best is not None and noise / step > best[1]:
            break
        ends = {0: known}
        for stencil in _STENCILS:
            (offsets, _), _ = stencil
            for k in sorted(offsets, key=abs):
                if k not in ends:
                    ends[k] = value(k * step)
                if ends[k][1] != known[1]:
                    break
            else:
                orders = [
                    np.sum([w * ends[k][0] for k, w in zip(*parts, strict=True)], axis=0) / step
                    for parts in stencil
                ]
                largest = max(abs(w) for w in stencil[0][1])
                error = np.abs(orders[0] - orders[1]).max() + noise / step * largest
                if best is None or error < best[1]:
                    best = orders[0], float(error)
                break
    return best
