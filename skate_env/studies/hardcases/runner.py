"""Run hard cases: measured value, margin to the limit, cost."""

import math
from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass
from functools import cache

from ...common import progress_bar
from .case import METHODS, Case, CaseContext, Unexpected
from .catalogue import CASES

NAMED = ("balanced", "reference", "fast")
"""Accuracies that scenes can name; the default of the command."""
EVERY = "all"
"""Selects all methods."""

# Simulated time of the nominal case, the gait of `paper_printed` [s].
_NOMINAL_TIME = 2.0


@dataclass(frozen=True)
class Result:
    """Result of one case with one method."""

    case: Case
    method: str
    measured: float | None
    """In the case's unit; None if the case failed without a finite number."""
    cost: float | None
    """Evaluations per simulated second, relative to the nominal case; None if no time passes."""
    reason: str = ""
    """Why there is no number."""

    @property
    def limit(self) -> float:
        """Largest number that passes."""
        return self.case.limits[self.method]

    @property
    def passed(self) -> bool:
        """Whether there is a number, and it is at most the limit."""
        return self.measured is not None and self.measured <= self.limit

    @property
    def exact(self) -> bool:
        """Whether the number is 0 and its margin infinite."""
        return self.measured == 0.0

    @property
    def margin(self) -> float | None:
        """Limit divided by the number; None without a number and where it is 0."""
        return self.limit / self.measured if self.measured else None


@dataclass(frozen=True)
class Run:
    """Results of some cases with some methods."""

    cases: Sequence[Case]
    methods: Sequence[str]
    results: Sequence[Result]

    @property
    def passed(self) -> bool:
        """Whether all results passed."""
        return all(result.passed for result in self.results)

    def of(self, case: Case) -> list[Result]:
        """Results of one case, one for each method that supports it."""
        return [result for result in self.results if result.case is case]

    def kinds(self) -> dict[str, list[Case]]:
        """Cases by kind."""
        return by_kind(self.cases)


def by_kind(cases: Iterable[Case]) -> dict[str, list[Case]]:
    """Group cases by kind, in the order of the catalogue."""
    kinds: dict[str, list[Case]] = {}
    for case in cases:
        kinds.setdefault(case.kind, []).append(case)
    return kinds


def unsupported(case: Case, methods: Iterable[str]) -> list[str]:
    """Those of the methods that do not support a case."""
    return [method for method in methods if method not in case.limits]


def run(names: Sequence[str], methods: Sequence[str]) -> Run:
    """Run the named cases (all if none) with the named methods (`NAMED` if none).

    Raises
    ------
    ValueError
        If a name is unknown (the message lists the known ones), or no method supports any case.
    """
    cases = [CASES[name] for name in _known("case", names, CASES)] or list(CASES.values())
    chosen = _methods(methods)
    pairs = [(case, method) for case in cases for method in chosen if method in case.limits]
    if not pairs:
        whose = ", ".join(f"{case.name} ({case.excluded})" for case in cases)
        raise ValueError(f"{', '.join(chosen)}: does not support {whose}")
    return Run(cases, chosen, list(_results(pairs)))


def measure(case: Case, method: str) -> Result:
    """Run one case with one method; an exception is a failure of the case."""
    context, measured, reason = CaseContext(method), None, ""
    try:
        measured = float(case.measure(context))
        if not math.isfinite(measured) or measured < 0.0:
            measured, reason = None, f"measured {measured}"
    except BaseException as error:
        # A panic of the engine is not an Exception, and its class cannot be imported.
        if not isinstance(error, Exception) and type(error).__name__ != "PanicException":
            raise
        reason = str(error) if isinstance(error, Unexpected) else f"{type(error).__name__}: {error}"
    cost = context.cost()
    return Result(case, method, measured, None if cost is None else cost / nominal(method), reason)


@cache
def nominal(method: str) -> float:
    """Return the evaluations of the dynamics per second of `paper_printed`'s gait [1/s]."""
    context = CaseContext(method)
    context.simulator("paper_printed").advance(_NOMINAL_TIME)
    cost = context.cost()
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
    """Return the names without repetitions; raise ValueError for unknown ones."""
    every = list(known)
    for name in names:
        if name not in every:
            raise ValueError(f'{what} "{name}": unknown; known are {", ".join(every)}')
    return list(dict.fromkeys(names))
