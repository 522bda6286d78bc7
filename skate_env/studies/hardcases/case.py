"""What a hard case is, and what it works with."""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ..._core import Scene, Simulator
from ...scenes import load_scene, replace

Array = NDArray[np.float64]

METHODS: dict[str, Any] = {
    "balanced": "balanced",
    "reference": "reference",
    "fast": "fast",
    "rosenbrock": {"method": "rosenbrock", "tolerance": 1e-5},
    "rk4": {"method": "rk4", "step": 5e-4},
}
"""Accuracies that a case may claim to support, as a scene's `accuracy` has them."""
EVENTS = ("balanced", "reference", "rosenbrock", "rk4")
"""Those that locate events; `fast` steps over them."""
ALL = tuple(METHODS)


class Unexpected(Exception):
    """A case took a turn that its criterion has no number for."""


class Lab:
    """Where a case is run: scenes at one accuracy, simulators whose work is counted."""

    def __init__(self, method: str) -> None:
        self.method = method
        self._simulators: list[Simulator] = []

    def scene(self, base: str | Scene, changes: Mapping[str, Any] | None = None) -> Scene:
        """Copy a scene, or a preset, with this accuracy and some fields changed."""
        scene = load_scene(base) if isinstance(base, str) else base
        return replace(scene, {**(changes or {}), "accuracy": METHODS[self.method]})

    def simulator(self, base: str | Scene, changes: Mapping[str, Any] | None = None) -> Simulator:
        """Build a simulator of such a scene."""
        return self.watch(Simulator(self.scene(base, changes)))

    def watch(self, sim: Simulator) -> Simulator:
        """Count what a simulator does from its last reset on."""
        self._simulators.append(sim)
        return sim

    def cost(self) -> float | None:
        """Count evaluations of the dynamics per simulated second; None if no time has passed."""
        time = sum(sim.time for sim in self._simulators)
        evaluations = sum(sim.stats()["evaluations"] for sim in self._simulators)
        return evaluations / time if time > 1e-6 else None


@dataclass(frozen=True)
class Case:
    """One hard case: a builder that returns a number, and the largest number that passes."""

    name: str
    kind: str
    setup: str
    naive: str
    """What a naive code does there."""
    law: str
    """What the criterion rests on."""
    criterion: str
    """What is measured, as a phrase."""
    unit: str
    limits: Mapping[str, float]
    """By method: those that are missing do not claim to support the case."""
    measure: Callable[[Lab], float]
    excluded: str
    """Why methods are missing."""


@dataclass
class Chapter:
    """The cases of one kind; `case` adds one."""

    kind: str
    cases: list[Case]

    def case(
        self,
        *,
        setup: str,
        naive: str,
        law: str,
        criterion: str,
        unit: str = "",
        limit: float | Mapping[str, float],
        methods: Sequence[str] = ALL,
        excluded: str = "",
    ) -> Callable[[Callable[[Lab], float]], Callable[[Lab], float]]:
        """Decorate a builder, whose name is the case's; see `Case`.

        One `limit` may hold for all `methods`, or each has its own.
        """
        limits = limit if isinstance(limit, Mapping) else dict.fromkeys(methods, limit)
        if missing := set(METHODS) - set(limits):
            assert excluded, f"say why {sorted(missing)} do not support the case"

        def add(measure: Callable[[Lab], float]) -> Callable[[Lab], float]:
            name = measure.__name__
            self.cases.append(
                Case(name, self.kind, setup, naive, law, criterion, unit, limits, measure, excluded)
            )
            return measure

        return add
