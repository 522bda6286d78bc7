"""Reference solutions of the motions, and their uncertainty."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass, field

import numpy as np

from ..motions.cases import Case
from . import engine, independent
from .outcome import COMPARED, Errors, Outcome, errors, failure, largest
from .settings import NEXT_TIGHTEST, TIGHTEST, dopri5

MARGIN = 100.0
"""An error is trusted if it exceeds the references' disagreement by this factor."""


@dataclass(frozen=True)
class CrossCheck:
    """Difference of an independent reference from the engine's."""

    solver: str
    tolerance: float
    starts: int
    difference: Errors
    """Largest over all starts."""
    failures: tuple[str, ...]
    """For starts with a different motion: the start's number and the difference."""


@dataclass(frozen=True)
class Check:
    """Error of a quantity that is known in closed form."""

    what: str
    error: float
    unit: str


@dataclass
class Reference:
    """Reference solutions of a case, one for each start."""

    outcomes: list[Outcome]
    self_change: Errors
    """Largest change with the next coarser tolerance."""
    cross_checks: list[CrossCheck] = field(default_factory=list)
    checks: list[Check] = field(default_factory=list)

    @property
    def disagreement(self) -> Errors:
        """Largest difference to an independent reference or to the next coarser tolerance."""
        others = [check.difference for check in self.cross_checks]
        return largest([self.self_change, *others])

    @property
    def sure(self) -> bool:
        """Whether all references have the same motion."""
        return not any(check.failures for check in self.cross_checks)

    def trusts(self, quantity: str, error: float | None) -> bool:
        """Whether an error is large compared with that of the reference."""
        if error is None:
            return False
        if quantity not in COMPARED:
            return True
        return self.sure and error > MARGIN * (getattr(self.disagreement, quantity) or 0.0)


def find(
    case: Case, starts: int, solvers: Sequence[tuple[str, int]], progress: Callable[[], object]
) -> Reference:
    """Compute the reference; ``solvers`` are SciPy's with their numbers of starts.

    ``progress`` is called after every start of every method.
    """
    outcomes, changes = [], []
    for start in range(starts):
        tight, next_tight = (
            engine.run(case, dopri5(tolerance), start) for tolerance in (TIGHTEST, NEXT_TIGHTEST)
        )
        outcomes.append(tight)
        if failure(next_tight, tight) is None:
            changes.append(errors(next_tight, tight))
        progress()
    reference = Reference(outcomes, largest(changes))
    for solver, count in solvers:
        reference.cross_checks.append(_cross_check(case, outcomes[:count], solver, progress))
    reference.checks = list(_checks(case, outcomes[0]))
    return reference


def _cross_check(
    case: Case, outcomes: Sequence[Outcome], solver: str, progress: Callable[[], object]
) -> CrossCheck:
    differences, failures = [], []
    for start, first in enumerate(outcomes):
        try:
            other = independent.run(case, start, solver)
        except (ArithmeticError, ValueError) as error:
            failures.append(f"{start}: {error}")
        else:
            reason = failure(other, first)
            if reason is None:
                differences.append(errors(other, first))
            else:
                failures.append(f"{start}: {reason}")
        progress()
    tolerance = independent.SOLVERS[solver]
    return CrossCheck(solver, tolerance, len(outcomes), largest(differences), tuple(failures))


def _checks(case: Case, outcome: Outcome) -> list[Check]:
    """Compare with closed forms."""
    sim = engine.begin(case, case.scene, 0)
    numbers = case.scene.parameters()
    gravity = numbers["ice.gravity"][0]
    if case.name == "slide":
        slowing = numbers["ice.friction.mu_forward"][0] * gravity
        speed = float(sim.v[0])
        stopped = outcome.event_times[0] - speed / slowing
        way = outcome.slide - 0.5 * speed**2 / slowing
        return [Check("distance to rest", abs(way), "m"), Check("time to rest", abs(stopped), "s")]
    if case.name == "flight":
        before, after = (sim.energy(q, v) for q, v in ((sim.q, sim.v), (outcome.q, outcome.v)))
        change = sim.momentum(outcome.q, outcome.v) - sim.momentum(sim.q, sim.v)
        mass = sum(float(body["mass"]) for body in sim.bodies())
        change[1] += mass * gravity * outcome.time
        return [
            Check("energy", abs(sum(after) - sum(before)), "J"),
            Check("linear momentum", float(np.abs(change[:2]).max()), "kg m/s"),
        ]
    return []
