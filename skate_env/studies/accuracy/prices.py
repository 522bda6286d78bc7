"""Cheapest setting of every method within a bound of the error, and measured orders."""

from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass

import numpy as np

from .study import CaseStudy, Row, Study

BOUNDS = (1e-3, 1e-4, 1e-6)
"""Errors of the slide distance [m]."""


@dataclass(frozen=True)
class Price:
    """The cheapest setting of a method with an error of the slide distance below a bound."""

    case: str
    bound: float
    """[m]"""
    tool: str
    method: str
    label: str | None
    """The setting; None if no setting reaches the bound."""
    error: float | None
    """Error of the setting [m]."""
    time: float | None
    """Wall time per simulated second [s]."""


def prices(study: Study, bounds: Sequence[float] = BOUNDS) -> list[Price]:
    """Find the cheapest settings for every bound, motion with contact, tool and method."""
    return [
        price
        for case in study.cases
        if not case.smooth
        for bound in bounds
        for price in _case_prices(case, bound)
    ]


@dataclass(frozen=True)
class Order:
    """Measured convergence order of a method: the exponent of its step in the position error."""

    case: str
    tool: str
    method: str
    order: float
    settings: int
    """Number of settings with trusted errors."""


def orders(study: Study) -> list[Order]:
    """Fit the order of every method with fixed steps and at least three trusted errors."""
    return [order for case in study.cases for order in case_orders(case)]


def case_orders(case: CaseStudy) -> list[Order]:
    """Fit the orders for one motion."""
    found = []
    for (tool, method), rows in _methods(case):
        points = [
            (row.value, row.errors.position)
            for row in rows
            if row.fixed_step and row.trusted.get("position")
        ]
        if len(points) >= 3:
            steps, errors = np.log(np.array(points, dtype=float)).T
            slope = float(np.polyfit(steps, errors, 1)[0])
            found.append(Order(case.name, tool, method, slope, len(points)))
    return found


def cheapest(prices: Iterable[Price]) -> Price | None:
    """Return the cheapest one; None if none reaches its bound."""
    paid = [price for price in prices if price.time is not None]
    return min(paid, key=lambda price: price.time or 0.0, default=None)


def _case_prices(case: CaseStudy, bound: float) -> list[Price]:
    # The uncertainty of the reference is added to the error.
    floor = case.reference.disagreement.slide or 0.0
    found = []
    for (tool, method), rows in _methods(case):
        best = min((row for row in rows if _keeps(row, bound, floor)), key=_time, default=None)
        known = (best.label, best.errors.slide, best.time) if best else (None, None, None)
        found.append(Price(case.name, bound, tool, method, *known))
    return found


def _methods(case: CaseStudy) -> Iterator[tuple[tuple[str, str], list[Row]]]:
    for key in dict.fromkeys((row.tool, row.method) for row in case.rows):
        yield key, [row for row in case.rows if (row.tool, row.method) == key]


def _keeps(row: Row, bound: float, floor: float) -> bool:
    error = row.errors.slide
    return row.time is not None and error is not None and error + floor <= bound


def _time(row: Row) -> float:
    return row.time if row.time is not None else float("inf")
