"""What an error costs: the cheapest setting of every method that keeps a bound."""

from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass

import numpy as np

from .layout import length
from .study import ENGINE, CaseStudy, Row, Study

BOUNDS = (1e-3, 1e-4, 1e-6)
"""Errors of the slide distance [m]."""
# Widths of the text's columns.
_NAME, _CELL = 18, 31


@dataclass(frozen=True)
class Price:
    """What it takes to keep an error of the slide distance below a bound."""

    case: str
    bound: float
    """[m]"""
    tool: str
    method: str
    label: str | None
    """The cheapest setting; None where none is good enough."""
    error: float | None
    """Its own [m]."""
    time: float | None
    """For a simulated second [s]."""

    @property
    def real_time_factor(self) -> float | None:
        """How many times faster than the motion itself."""
        return None if self.time is None else 1.0 / self.time


def prices(study: Study, bounds: Sequence[float] = BOUNDS) -> list[Price]:
    """Find the price of every bound, for every motion on the ice, tool and method."""
    return [
        price
        for case in study.cases
        if not case.smooth
        for bound in bounds
        for price in _case_prices(case, bound)
    ]


@dataclass(frozen=True)
class Order:
    """With which power of its step a method's error of the position falls."""

    case: str
    tool: str
    method: str
    order: float
    settings: int
    """From so many settings whose errors are trusted."""


def orders(study: Study) -> list[Order]:
    """Fit the order of every method with fixed steps, where three settings at least count."""
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
    """Find the cheapest of all."""
    paid = [price for price in prices if price.time is not None]
    return min(paid, key=lambda price: price.time or 0.0, default=None)


def text(study: Study) -> str:
    """Lay out the engine's methods, and the best of other tools, for a terminal."""
    every = prices(study)
    bounds = list(dict.fromkeys(price.bound for price in every))
    lines = [
        "Cheapest setting for an error of the slide distance of at most (milliseconds for a",
        "simulated second, times faster than the motion):",
        " " * _NAME + "".join(length(bound).rjust(_CELL) for bound in bounds),
    ]
    for case in study.cases:
        here = [price for price in every if price.case == case.name]
        lines += ["", case.name] * bool(here)
        for method in dict.fromkeys(price.method for price in here if price.tool == ENGINE):
            cells = [_cell(p) for p in here if (p.tool, p.method) == (ENGINE, method)]
            lines.append(f"  {method}".ljust(_NAME) + "".join(cells))
        for tool in dict.fromkeys(price.tool for price in here if price.tool != ENGINE):
            theirs = [price for price in here if price.tool == tool]
            best = [cheapest(p for p in theirs if p.bound == bound) for bound in bounds]
            lines.append(f"  best of {tool}".ljust(_NAME) + "".join(map(_cell, best)))
    return "\n".join(lines)


def _case_prices(case: CaseStudy, bound: float) -> list[Price]:
    # The reference's own error is added to be sure.
    floor = case.reference.disagreement.slide or 0.0
    found = []
    for (tool, method), own in _methods(case):
        best = min((row for row in own if _keeps(row, bound, floor)), key=_time, default=None)
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


def _cell(price: Price | None) -> str:
    if price is None or price.time is None:
        return "-".rjust(_CELL)
    factor = 1.0 / price.time
    digits = 0 if factor >= 10.0 else 2
    return f"{price.label}: {1e3 * price.time:#.3g}, {factor:.{digits}f}x".rjust(_CELL)
