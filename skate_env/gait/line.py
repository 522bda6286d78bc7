"""A line of a card: a quantity with its definition, unit and requirement."""

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import numpy as np

Value = float | dict[str, float]


@dataclass(frozen=True)
class Limit:
    """Closed range of a value; infinite where it is open."""

    at_least: float = -np.inf
    at_most: float = np.inf

    def met(self, value: Value) -> bool:
        """Whether a value, or every one of several, is inside; NaN and none are not."""
        values = list(value.values()) if isinstance(value, dict) else [value]
        return bool(values) and all(self.at_least <= x <= self.at_most for x in values)

    def __str__(self) -> str:
        if self.at_least == self.at_most:
            return f"{self.at_least:g}"
        if np.isinf(self.at_least):
            return f"≤ {self.at_most:g}"
        if np.isinf(self.at_most):
            return f"≥ {self.at_least:g}"
        return f"{self.at_least:g} to {self.at_most:g}"


@dataclass(frozen=True)
class Line:
    """A line of the card.

    Attributes
    ----------
    key
        Name for programs.
    name, unit, definition
        For people; the unit of shares and counts is 1.
    measure
        Value of a motion or of its robustness: a number, NaN where there is none, or a number per
        state, end of a sole, or joint.
    required
        Requirement on the paper's gait.
    human
        Stricter requirement on a gait that is possible for a human.
    rows
        What the numbers belong to, where there are several.
    """

    key: str
    name: str
    unit: str
    definition: str
    measure: Callable[[Any], Any]
    required: Limit | None = None
    human: Limit | None = None
    rows: str | None = None

    @property
    def title(self) -> str:
        """Name with the unit."""
        return self.name if self.unit == "1" else f"{self.name} [{self.unit}]"


ONE = Limit(1.0, 1.0)
