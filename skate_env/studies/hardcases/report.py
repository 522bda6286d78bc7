"""Reports of the hard cases: terminal table, Markdown, CSV, JSON."""

import textwrap
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from ...common import files
from .. import report
from ..report import EMPTY, Heading, Notes, Part, Table, escaped, machine, significant
from .case import Case
from .chart import figure
from .runner import Result, Run, by_kind, nominal, unsupported

_WIDTH = 120
_HEAD = ("method", "measured", "limit", "margin", "cost")
_OVERVIEW = ("kind", "cases", "runs", "failed", "smallest margin", "highest cost")
_EXACT, _FAILED, _PASSED = "exact", "FAILED", "passed"


@dataclass(frozen=True)
class _Worst:
    """The result with the smallest margin and the one with the highest cost."""

    margin: Result | None
    cost: Result | None


def listing(cases: Sequence[Case]) -> str:
    """List the cases with their setups."""
    lines = []
    for kind, group in by_kind(cases).items():
        lines.append(f"{kind}:")
        for case in group:
            indent = " " * 6
            setup = textwrap.wrap(case.setup, 94, break_on_hyphens=False)
            lines += [f"  {case.name}", *(indent + line for line in setup)]
    return "\n".join(lines)


def text(run: Run) -> str:
    """Format all results for a terminal."""
    rows: list[tuple[str, ...]] = []
    sections: dict[int, list[str]] = {}
    for kind, cases in run.kinds().items():
        sections.setdefault(len(rows), []).extend(("", f"{kind}:"))
        for case in cases:
            results = run.of(case)
            criterion = _criterion(case) if results else f"not supported: {case.excluded}"
            lines = textwrap.wrap(f"{case.name}: {criterion}", _WIDTH, subsequent_indent="  ")
            sections.setdefault(len(rows), []).extend(lines)
            rows += [(*_cells(each), _PASSED if each.passed else _FAILED) for each in results]
    table = Table("", (*_HEAD, ""), rows, sections=sections)
    return report.text([table, Notes([*notes(run), _total(run.results)])], _WIDTH)


def _cells(result: Result) -> tuple[str, ...]:
    """Format method, measured value, limit, margin and cost."""
    measured = EMPTY if result.measured is None else f"{result.measured:.3g}"
    margin = EMPTY if result.margin is None else f"{result.margin:.3g}"
    return (
        result.method,
        measured,
        f"{result.limit:g}",
        _EXACT if result.exact else margin,
        significant(result.cost),
    )


def _criterion(case: Case) -> str:
    return f"{case.criterion} [{case.unit}]" if case.unit else case.criterion


def notes(run: Run) -> Iterator[str]:
    """Explain the columns, unsupported cases and failures."""
    yield (
        "margin: limit divided by the measured value; a case fails below 1; exact: measured 0. "
        "cost: evaluations of the dynamics per simulated second, divided by those of "
        "paper_printed's gait with the same method, "
        f"{', '.join(f'{nominal(method):.0f} ({method})' for method in run.methods)}; "
        f"{EMPTY}: no time passes."
    )
    for method in run.methods:
        if missing := [case for case in run.cases if unsupported(case, [method])]:
            why: dict[str, list[str]] = {}
            for case in missing:
                why.setdefault(case.excluded, []).append(case.name)
            reasons = "; ".join(f"{reason} ({', '.join(names)})" for reason, names in why.items())
            yield f"{method} does not support {len(missing)} of {len(run.cases)} cases: {reasons}."
    for result in run.results:
        if not result.passed:
            yield f"{_FAILED}: {result.case.name} at {result.method}: {_why(result)}"


def _why(result: Result) -> str:
    if result.measured is None:
        return result.reason
    return f"measured {result.measured:.3g}, more than {result.limit:g}"


def _total(results: Sequence[Result]) -> str:
    passed = sum(result.passed for result in results)
    worst = _worst(results)
    parts = [f"{passed} of {len(results)} runs pass, {sum(r.exact for r in results)} of them exact"]
    parts += [f"smallest margin {_margin(worst.margin)}"] if worst.margin else []
    parts += [f"highest cost {_cost(worst.cost)}"] if worst.cost else []
    return "; ".join(parts)


def _worst(results: Sequence[Result]) -> _Worst:
    margins = [result for result in results if result.margin is not None]
    costs = [result for result in results if result.cost is not None]
    return _Worst(
        min(margins, key=lambda result: result.margin or 0.0, default=None),
        max(costs, key=lambda result: result.cost or 0.0, default=None),
    )


def _margin(result: Result | None) -> str:
    return f"{result.margin:.3g} ({result.case.name}, {result.method})" if result else EMPTY


def _cost(result: Result | None) -> str:
    return f"{significant(result.cost)} ({result.case.name}, {result.method})" if result else EMPTY


def markdown(run: Run, command: str) -> str:
    """Write all results for the documentation."""
    heading = f"{_total(run.results)} (`{command}`, {machine()}). By kind:"
    parts: list[Part] = [Table(heading, _OVERVIEW, list(_overview(run))), Notes(list(notes(run)))]
    for kind, cases in run.kinds().items():
        parts.append(Heading(kind[:1].upper() + kind[1:]))
        for case in cases:
            parts += _section(case, run)
    return report.markdown(parts)


def _overview(run: Run) -> Iterator[tuple[str, ...]]:
    for kind, cases in run.kinds().items():
        results = [result for case in cases for result in run.of(case)]
        worst = _worst(results)
        yield (
            kind,
            str(len(cases)),
            str(len(results)),
            str(sum(not result.passed for result in results)),
            _margin(worst.margin),
            _cost(worst.cost),
        )


def _section(case: Case, run: Run) -> Iterator[Part]:
    yield Heading(f"`{case.name}`", 4)
    described = {
        "Setup": case.setup,
        "A naive code": case.naive,
        "Law": case.law,
        "Measured": _criterion(case),
    }
    yield "\n".join(f"- *{what}:* {escaped(words)}" for what, words in described.items())
    yield Table("", _HEAD, [_cells(result) for result in run.of(case)])
    for result in run.of(case):
        if not result.passed:
            yield f"**{_FAILED}** at `{result.method}`: {escaped(_why(result))}"
    if missing := unsupported(case, run.methods):
        names = ", ".join(f"`{method}`" for method in missing)
        yield f"Not supported by {names}: {escaped(case.excluded)}."


def summary(run: Run) -> dict[str, Any]:
    """All results as JSON values; None where there is no number."""
    return {
        "methods": list(run.methods),
        "nominal_evaluations_per_second": {method: nominal(method) for method in run.methods},
        "results": list(map(_row, run.results)),
        "not_claimed": [
            {"case": case.name, "method": method, "reason": case.excluded}
            for case in run.cases
            for method in unsupported(case, run.methods)
        ],
        "failures": [f"{r.case.name}-{r.method}" for r in run.results if not r.passed],
        "passed": run.passed,
    }


def _row(result: Result) -> dict[str, Any]:
    case, found = result.case, ("measured", "limit", "exact", "margin")
    row = {"case": case.name, "kind": case.kind, "method": result.method}
    row |= {"criterion": case.criterion, "unit": case.unit}
    row |= {name: getattr(result, name) for name in found}
    return row | {"cost_ratio": result.cost, "passed": result.passed, "reason": result.reason}


@files.own_style
def write(run: Run, folder: Path, command: str) -> None:
    """Write hard-cases.csv, hard-cases.md and hard-cases.png into a folder."""
    texts = {
        "hard-cases.csv": report.as_csv(map(_row, run.results)),
        "hard-cases.md": markdown(run, command),
    }
    report.write(folder, texts, {"hard-cases.png": figure(run)})
