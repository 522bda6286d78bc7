"""Cost of a method as a function of its error, interpolated between its settings.

The settings of a method are points; between them the cost is a power of the error, a straight line
on logarithmic axes. Settings that cost more than a more accurate one are left out.
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np


@dataclass(frozen=True)
class Point:
    """Error and cost of a setting."""

    error: float
    """At least the smallest trusted error."""
    cost: float


def front(points: Sequence[Point]) -> list[Point]:
    """Return the Pareto front: every point is more accurate than all cheaper ones."""
    best: list[Point] = []
    for point in sorted(points, key=lambda point: (point.cost, point.error)):
        if not best or point.error < best[-1].error:
            best.append(point)
    return best


def cost_at(points: Sequence[Point], error: float) -> float | None:
    """Interpolate the cost of an error; None where no setting reaches it.

    An error larger than the cheapest setting's costs as much as that one.
    """
    best = front(points)
    if not best or error < best[-1].error * (1.0 - 1e-9):
        return None
    # `numpy.interp` requires ascending abscissae.
    errors, costs = np.log([(point.error, point.cost) for point in reversed(best)]).T
    return float(np.exp(np.interp(np.log(error), errors, costs)))
