"""Cost against error: what a tool takes for an error between those of its settings.

A method's settings are points; from one to the next cost is taken to be a power of the error, a
straight line on logarithmic axes. Settings that cost more than a better one are left out, and of
several methods the cheapest counts: the lower envelope.
"""

from collections.abc import Iterable, Sequence
from dataclasses import dataclass

import numpy as np

from .reference import MARGIN
from .settings import NAMED
from .study import ENGINE, MUJOCO, CaseStudy, Row

DECADES = tuple(10.0**-k for k in range(2, 10))
"""Errors at which tools are compared."""


@dataclass(frozen=True)
class Point:
    """A setting as the curve sees it."""

    error: float
    """An error that is not trusted counts as the least one that would be."""
    cost: float


@dataclass(frozen=True)
class Best:
    """The cheapest method at an error."""

    method: str
    cost: float


@dataclass(frozen=True)
class Ratio:
    """What two tools take for the same error."""

    case: str
    error: float
    ours: Best | None
    """None where no setting gets there."""
    theirs: Best | None
    known: bool
    """The references know the motion well enough to tell."""

    @property
    def value(self) -> float | None:
        """Cost of theirs divided by cost of ours; above 1 ours is cheaper."""
        if self.ours is None or self.theirs is None:
            return None
        return self.theirs.cost / self.ours.cost


def limit(case: CaseStudy, quantity: str = "position") -> float | None:
    """Give the least error that counts; None where the references do not see one motion."""
    if not case.reference.sure:
        return None
    return MARGIN * (getattr(case.reference.disagreement, quantity) or 0.0)


def points(
    case: CaseStudy, rows: Iterable[Row], quantity: str = "position", cost: str = "time"
) -> list[Point]:
    """Place the settings that did not fail, cheapest first."""
    least = limit(case, quantity)
    if least is None:
        return []
    found = []
    for row in rows:
        error, price = getattr(row.errors, quantity), getattr(row, cost)
        if error is not None and price is not None and max(error, least) > 0.0:
            found.append(Point(max(error, least), price))
    return sorted(found, key=lambda point: point.cost)


def front(points: Sequence[Point]) -> list[Point]:
    """Leave out every setting than which a cheaper one is as good."""
    best: list[Point] = []
    for point in sorted(points, key=lambda point: (point.cost, point.error)):
        if not best or point.error < best[-1].error:
            best.append(point)
    return best


def cost_at(points: Sequence[Point], error: float) -> float | None:
    """Interpolate the cost of an error; None where no setting is as good.

    An error larger than the cheapest setting's costs as much as that one.
    """
    best = front(points)
    if not best or error < best[-1].error * (1.0 - 1e-9):
        return None
    # Both ascend, as `numpy.interp` asks for.
    errors, costs = np.log([(point.error, point.cost) for point in reversed(best)]).T
    return float(np.exp(np.interp(np.log(error), errors, costs)))


def methods(case: CaseStudy, tool: str) -> dict[str, list[Row]]:
    """Group a tool's settings; those that only have a name are no method."""
    found: dict[str, list[Row]] = {}
    for row in case.rows:
        if row.tool == tool and row.method != NAMED:
            found.setdefault(row.method, []).append(row)
    return found


def best(case: CaseStudy, tool: str, error: float, quantity: str = "position") -> Best | None:
    """Find the cheapest of a tool's methods at an error; None where none gets there."""
    costs = [
        Best(method, cost)
        for method, rows in methods(case, tool).items()
        if (cost := cost_at(points(case, rows, quantity), error)) is not None
    ]
    return min(costs, key=lambda one: one.cost, default=None)


def ratios(
    case: CaseStudy,
    errors: Sequence[float] = DECADES,
    quantity: str = "position",
    ours: str = ENGINE,
    theirs: str = MUJOCO,
) -> list[Ratio]:
    """Compare the best of two tools at equal errors."""
    least = limit(case, quantity)
    return [
        Ratio(
            case.name,
            error,
            best(case, ours, error, quantity),
            best(case, theirs, error, quantity),
            least is not None and error >= least,
        )
        for error in errors
    ]
