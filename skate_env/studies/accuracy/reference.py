"""What the motions truly are, and how sure that is."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass, field

import numpy as np

from . import engine, independent
from .cases import Case
from .outcome import COMPARED, Errors, Outcome, errors, failure, largest
from .settings import NEXT_TIGHTEST, TIGHTEST, dopri5

MARGIN = 100.0
"""An error counts where it is as many times larger than the references' disagreement."""


@dataclass(frozen=True)
class Opinion:
    """How far an independent reference is from the engine's own."""

    solver: str
    tolerance: float
    starts: int
    difference: Errors
    """The largest of all starts."""
    failures: tuple[str, ...]
    """Where it saw another motion: the start's number and what was different."""
    evaluations: float
    """Per simulated second."""


@dataclass(frozen=True)
class Check:
    """A figure that is known without integration."""

    what: str
    error: float
    unit: str


@dataclass
class Reference:
    """The reference of a case, start by start."""

    outcomes: list[Outcome]
    self_change: Errors
    """What the next coarser tolerance changes, at most."""
    opinions: list[Opinion] = field(default_factory=list)
    checks: list[Check] = field(default_factory=list)

    @property
    def disagreement(self) -> Errors:
        """The largest difference to any independent reference; where there is none, to itself."""
        others = [opinion.difference for opinion in self.opinions]
        return largest([self.self_change, *others])

    @property
    def sure(self) -> bool:
        """Say whether all references saw the same motion."""
        return not any(opinion.failures for opinion in self.opinions)

    def trusts(self, quantity: str, error: float | None) -> bool:
        """Say whether an error is so large that the reference's own does not matter."""
        if error is None:
            return False
        if quantity not in COMPARED:
            return True
        return self.sure and error > MARGIN * (getattr(self.disagreement, quantity) or 0.0)


def find(
    case: Case,
    starts: int,
    solvers: Sequence[tuple[str, int]],
    progress: Callable[[], object],
) -> Reference:
    """Compute the reference; ``solvers`` are SciPy's with their number of starts.

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
        reference.opinions.append(_opinion(case, outcomes[:count], solver, progress))
    reference.checks = list(_checks(case, outcomes[0]))
    return reference


def _opinion(
    case: Case, outcomes: Sequence[Outcome], solver: str, progress: Callable[[], object]
) -> Opinion:
    differences, failures, evaluations = [], [], 0.0
    for start, own in enumerate(outcomes):
        try:
            other = independent.run(case, start, solver)
        except (ArithmeticError, ValueError) as error:
            failures.append(f"{start}: {error}")
        else:
            evaluations += other.stats["evaluations"] / other.time
            said = failure(other, own)
            if said is None:
                differences.append(errors(other, own))
            else:
                failures.append(f"{start}: {said}")
        progress()
    tolerance = independent.SOLVERS[solver]
    each = evaluations / len(outcomes)
    return Opinion(solver, tolerance, len(outcomes), largest(differences), tuple(failures), each)


def _checks(case: Case, outcome: Outcome) -> list[Check]:
    """Compare with what is known in closed form."""
    sim = engine.begin(case, case.scene, 0)
    numbers = case.scene.parameters()
    gravity = numbers["ice.gravity"][0]
    if case.name == "slide":
        slowing = numbers["ice.friction.mu_forward"][0] * gravity
        speed = float(sim.v[0])
        stopped = outcome.event_times[0] - speed / slowing
        way = outcome.slide - 0.5 * speed**2 / slowing
        return [
            Check("way to rest", abs(way), "m"),
            Check("time to rest", abs(stopped), "s"),
        ]
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
