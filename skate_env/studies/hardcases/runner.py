"""Hard cases, run: what each measures, how far that is from its limit, what it costs."""

import math
from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass
from functools import cache

from ...progress import progress_bar
from .case import METHODS, Case, Lab, Unexpected
from .catalogue import CASES

NAMED = ("balanced", "reference", "fast")
"""Accuracies that have a name in scenes."""
EVERY = "all"
"""Stands for all methods."""

# Simulated time of the nominal case, the paper's gait [s].
_NOMINAL_TIME = 2.0


@dataclass(frozen=True)
class Result:
    """What one case measured by one method."""

    case: Case
    method: str
    measured: float | None
    """In the case's unit; None where it came to no finite number."""
    cost: float | None
    """Evaluations per simulated second over those of the nominal case; None if no time passes."""
    reason: str = ""
    """Why there is no number."""

    @property
    def limit(self) -> float:
        """Largest number that passes."""
        return self.case.limits[self.method]

    @property
    def passed(self) -> bool:
        """Whether the number is there and keeps the limit."""
        return self.measured is not None and self.measured <= self.limit

    @property
    def exact(self) -> bool:
        """Whether the number is 0, which has no finite margin."""
        return self.measured == 0.0

    @property
    def margin(self) -> float | None:
        """By how much the limit is larger than the number; None without one and where exact."""
        return self.limit / self.measured if self.measured else None


@dataclass(frozen=True)
class Run:
    """Some cases at some methods."""

    cases: Sequence[Case]
    methods: Sequence[str]
    results: Sequence[Result]

    @property
    def passed(self) -> bool:
        """Whether all did."""
        return all(result.passed for result in self.results)

    def of(self, case: Case) -> list[Result]:
        """Results of one case, one for each method that claims it."""
        return [result for result in self.results if result.case is case]

    def kinds(self) -> dict[str, list[Case]]:
        """Cases by kind."""
        return by_kind(self.cases)


def by_kind(cases: Iterable[Case]) -> dict[str, list[Case]]:
    """Sort cases by kind, in the order of the catalogue."""
    kinds: dict[str, list[Case]] = {}
    for case in cases:
        kinds.setdefault(case.kind, []).append(case)
    return kinds


def not_claimed(case: Case, methods: Iterable[str]) -> list[str]:
    """Those methods that do not claim to support a case."""
    return [method for method in methods if method not in case.limits]


def run(names: Sequence[str], methods: Sequence[str]) -> Run:
    """Run cases, all if none is named, at methods, the named accuracies if none is given.

    Raises
    ------
    ValueError
        If a name is unknown, with the known ones; if no method claims any of the cases.
    """
    cases = [CASES[name] for name in _known("case", names, CASES)] or list(CASES.values())
    chosen = _methods(methods)
    pairs = [(case, method) for case in cases for method in chosen if method in case.limits]
    if not pairs:
        whose = ", ".join(f"{case.name} ({case.excluded})" for case in cases)
        raise ValueError(f"{', '.join(chosen)}: does not claim to support {whose}")
    return Run(cases, chosen, list(_results(pairs)))


def measure(case: Case, method: str) -> Result:
    """Run one case at one method; whatever it throws is its failure."""
    lab, measured, reason = Lab(method), None, ""
    try:
        measured = float(case.measure(lab))
        if not math.isfinite(measured) or measured < 0.0:
            measured, reason = None, f"measured {measured}"
    except BaseException as error:
        # A panic of the engine is no Exception, and its class has no name to import.
        if not isinstance(error, Exception) and type(error).__name__ != "PanicException":
            raise
        reason = str(error) if isinstance(error, Unexpected) else f"{type(error).__name__}: {error}"
    cost = lab.cost()
    return Result(case, method, measured, None if cost is None else cost / nominal(method), reason)


@cache
def nominal(method: str) -> float:
    """Count the evaluations of the dynamics in a second of the paper's gait [1/s]."""
    lab = Lab(method)
    lab.simulator("paper").advance(_NOMINAL_TIME)
    cost = lab.cost()
    assert cost is not None
    return cost


def _results(pairs: Sequence[tuple[Case, str]]) -> Iterator[Result]:
    width = max(len(case.name) for case, _ in pairs)
    with progress_bar(len(pairs), "hard cases", "run") as bar:
        for case, method in pairs:
            bar.set_description(case.name.ljust(width))
            yield measure(case, method)
            bar.update()


def _methods(names: Sequence[str]) -> list[str]:
    if EVERY in names:
        return list(METHODS)
    given = _known("method", names, (*METHODS, EVERY)) or NAMED
    return [method for method in METHODS if method in given]


def _known(what: str, names: Sequence[str], known: Iterable[str]) -> list[str]:
    """Drop repetitions; refuse unknown names."""
    every = list(known)
    for name in names:
        if name not in every:
            raise ValueError(f'{what} "{name}": unknown; known are {", ".join(every)}')
    return list(dict.fromkeys(names))
