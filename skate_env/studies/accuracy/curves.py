"""Cost as a function of the error, interpolated between the settings of a tool.

The settings of a method are the points of a front. The cost of a tool is that of its cheapest
method: the lower envelope.
"""

from collections.abc import Iterable, Sequence
from dataclasses import dataclass

from ..fronts import Point, cost_at
from .reference import MARGIN
from .settings import NAMED
from .study import ENGINE, MUJOCO, CaseStudy, Row

DECADES = tuple(10.0**-k for k in range(2, 10))
"""Errors at which tools are compared."""


@dataclass(frozen=True)
class Best:
    """The cheapest method at an error."""

    method: str
    cost: float


@dataclass(frozen=True)
class Ratio:
    """Costs of two tools at the same error."""

    error: float
    ours: Best | None
    """None where no setting reaches the error."""
    theirs: Best | None
    known: bool
    """Whether the references are accurate enough for this error."""

    @property
    def value(self) -> float | None:
        """Cost of theirs divided by cost of ours; above 1 ours is cheaper."""
        if self.ours is None or self.theirs is None:
            return None
        return self.theirs.cost / self.ours.cost


def limit(case: CaseStudy, quantity: str = "position") -> float | None:
    """Return the smallest trusted error; None where the references disagree on the motion."""
    if not case.reference.sure:
        return None
    return MARGIN * (getattr(case.reference.disagreement, quantity) or 0.0)


def points(case: CaseStudy, rows: Iterable[Row]) -> list[Point]:
    """Return the settings that did not fail as errors of the state and times, cheapest first."""
    least = limit(case)
    if least is None:
        return []
    found = []
    for row in rows:
        error = row.errors.position
        if error is not None and row.time is not None and max(error, least) > 0.0:
            found.append(Point(max(error, least), row.time))
    return sorted(found, key=lambda point: point.cost)


def methods(case: CaseStudy, tool: str) -> dict[str, list[Row]]:
    """Group a tool's settings by method, without the named accuracies."""
    found: dict[str, list[Row]] = {}
    for row in case.rows:
        if row.tool == tool and row.method != NAMED:
            found.setdefault(row.method, []).append(row)
    return found


def best(case: CaseStudy, tool: str, error: float) -> Best | None:
    """Find the cheapest method of a tool at an error; None where none reaches it."""
    costs = [
        Best(method, cost)
        for method, rows in methods(case, tool).items()
        if (cost := cost_at(points(case, rows), error)) is not None
    ]
    return min(costs, key=lambda one: one.cost, default=None)


def ratios(case: CaseStudy, errors: Sequence[float] = DECADES) -> list[Ratio]:
    """Compare the cheapest methods of the engine and of MuJoCo at equal errors."""
    least = limit(case)
    return [
        Ratio(
            error,
            best(case, ENGINE, error),
            best(case, MUJOCO, error),
            known=least is not None and error >= least,
        )
        for error in errors
    ]
