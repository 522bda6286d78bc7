"""Types of the hard cases: a case, a group of cases, and the context in which a case runs."""

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
"""Accuracies that a case may support, as values of a scene's `accuracy`."""
EVENTS = ("balanced", "reference", "rosenbrock", "rk4")
"""Methods that locate events; `fast` steps over them."""
ALL = tuple(METHODS)


class Unexpected(Exception):
    """A case did not reach the situation that it measures."""


class CaseContext:
    """Builds the scenes of a case at one accuracy and counts the work of its simulators."""

    def __init__(self, method: str) -> None:
        self.method = method
        self.scenes: list[Scene] = []
        """The scenes that the case has built."""
        self._simulators: list[Simulator] = []

    def scene(self, base: str | Scene, changes: Mapping[str, Any] | None = None) -> Scene:
        """Copy a scene or a preset with this accuracy and some fields changed."""
        scene = load_scene(base) if isinstance(base, str) else base
        self.scenes.append(replace(scene, {**(changes or {}), "accuracy": METHODS[self.method]}))
        return self.scenes[-1]

    def simulator(self, base: str | Scene, changes: Mapping[str, Any] | None = None) -> Simulator:
        """Build a simulator whose work is counted."""
        return self.watch(Simulator(self.scene(base, changes)))

    def watch(self, sim: Simulator) -> Simulator:
        """Count the work of a simulator since its last reset."""
        self._simulators.append(sim)
        return sim

    def cost(self) -> float | None:
        """Return evaluations of the dynamics per simulated second; None if no time passed."""
        time = sum(sim.time for sim in self._simulators)
        evaluations = sum(sim.stats()["evaluations"] for sim in self._simulators)
        return evaluations / time if time > 1e-6 else None


@dataclass(frozen=True)
class Case:
    """One hard case: a function that measures a number, and the largest number that passes."""

    name: str
    kind: str
    setup: str
    naive: str
    """What a naive code does."""
    law: str
    """The law of mechanics behind the criterion."""
    criterion: str
    """The measured quantity."""
    unit: str
    limits: Mapping[str, float]
    """Largest value that passes, by method. Other methods do not support the case."""
    measure: Callable[[CaseContext], float]
    excluded: str
    """Why the other methods do not support the case."""


@dataclass
class CaseGroup:
    """The cases of one kind; the decorator `case` adds one."""

    kind: str
    cases: list[Case]

    def case(
        self,
        *,
        setup: str,
        naive: str,
        law: str,
        criterion: str,
        limit: float | Mapping[str, float] = 0.0,
        methods: Sequence[str] = (),
        excluded: str = "",
    ) -> Callable[[Callable[[CaseContext], float]], Callable[[CaseContext], float]]:
        """Decorate a function that measures a case and has its name; see `Case`.

        `criterion` may end with a unit in brackets. `limit` is one number for all `methods`, or a
        number for each method. Without `methods` all support the case, or with `excluded` `EVENTS`.
        """
        measured, _, unit = criterion.removesuffix("]").partition(" [")
        methods = methods or (EVENTS if excluded else ALL)
        limits = limit if isinstance(limit, Mapping) else dict.fromkeys(methods, limit)
        if missing := set(METHODS) - set(limits):
            assert excluded, f"give a reason why {sorted(missing)} do not support the case"

        def add(measure: Callable[[CaseContext], float]) -> Callable[[CaseContext], float]:
            name = measure.__name__
            self.cases.append(
                Case(name, self.kind, setup, naive, law, measured, unit, limits, measure, excluded)
            )
            return measure

        return add
