"""Reports of the hard cases: terminal table, Markdown, CSV, JSON."""

import textwrap
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from itertools import zip_longest
from pathlib import Path
from typing import Any

from ...common import files
from ..accuracy.layout import EMPTY, Table, escaped, significant
from ..versions import machine
from .case import Case
from .chart import figure
from .runner import Result, Run, by_kind, nominal, unsupported

_WIDTH = 120
_HEAD = ("method", "measured", "limit", "margin", "cost")
_METHOD, _WIDTHS = 11, (10, 8, 10, 7, 8)
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
    for kind, own in by_kind(cases).items():
        lines.append(f"{kind}:")
        for case in own:
            indent = " " * 6
            setup = textwrap.wrap(case.setup, 94, break_on_hyphens=False)
            lines += [f"  {case.name}", *(indent + line for line in setup)]
    return "\n".join(lines)


def text(run: Run) -> str:
    """Format all results for a terminal."""
    label = max(len(case.name) for case in run.cases) + 2
    lines = [f"{'case':<{label}}{_line((*_HEAD, ''))}  criterion"]
    for kind, cases in run.kinds().items():
        lines += ["", f"{kind}:"]
        for case in cases:
            lines += _block(case, run.of(case), label)
    lines.append("")
    said = [*notes(run), _total(run.results)]
    lines += [textwrap.fill(note, _WIDTH, subsequent_indent="  ") for note in said]
    return "\n".join(lines)


def _block(case: Case, results: Sequence[Result], label: int) -> Iterator[str]:
    """Format a case: a line for each method, with the criterion on the right."""
    lines = [_line((r.method, *_numbers(r), _PASSED if r.passed else _FAILED)) for r in results]
    width = len(_line((*_HEAD, "")))
    criterion = textwrap.wrap(_criterion(case), _WIDTH - label - width - 2)
    if not results:
        lines, criterion = [f"none of these methods supports it: {case.excluded}"], []
    for name, line, words in zip_longest([case.name], lines, criterion, fillvalue=""):
        yield f"{name:<{label}}{line:<{width}}  {words}".rstrip()


def _line(cells: Sequence[str]) -> str:
    return cells[0].ljust(_METHOD) + "".join(map(str.rjust, cells[1:], _WIDTHS))


def _numbers(result: Result) -> tuple[str, ...]:
    """Format measured value, limit, margin and cost."""
    measured = EMPTY if result.measured is None else f"{result.measured:.3g}"
    margin = EMPTY if result.margin is None else f"{result.margin:.3g}"
    return (
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
            said = "; ".join(f"{reason} ({', '.join(names)})" for reason, names in why.items())
            yield f"{method} does not support {len(missing)} of {len(run.cases)} cases: {said}."
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
    said = [f"{passed} of {len(results)} runs pass, {sum(r.exact for r in results)} of them exact"]
    if worst.margin is not None:
        said.append(f"smallest margin {_margin(worst.margin)}")
    if worst.cost is not None:
        said.append(f"highest cost {_cost(worst.cost)}")
    return "; ".join(said)


def _worst(results: Sequence[Result]) -> _Worst:
    margins = [result for result in results if result.margin is not None]
    costs = [result for result in results if result.cost is not None]
    return _Worst(
        min(margins, key=lambda result: result.margin or 0.0, default=None),
        max(costs, key=lambda result: result.cost or 0.0, default=None),
    )


def _margin(result: Result | None) -> str:
    if result is None:
        return EMPTY
    return f"{result.margin:.3g} ({result.case.name}, {result.method})"


def _cost(result: Result | None) -> str:
    if result is None:
        return EMPTY
    return f"{significant(result.cost)} ({result.case.name}, {result.method})"


def markdown(run: Run, command: str) -> str:
    """Write all results for the documentation."""
    said = f"{_total(run.results)} (`{command}`, {machine()}). By kind:"
    parts = [
        Table(said, _OVERVIEW, list(_overview(run))).markdown(),
        "\n".join(f"- {escaped(note)}" for note in notes(run)),
    ]
    for kind, cases in run.kinds().items():
        parts.append(f"### {kind[:1].upper()}{kind[1:]}")
        for case in cases:
            parts += _section(case, run)
    return "\n\n".join(parts) + "\n"


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


def _section(case: Case, run: Run) -> Iterator[str]:
    yield f"#### `{case.name}`"
    said = {
        "Setup": case.setup,
        "A naive code": case.naive,
        "Law": case.law,
        "Measured": _criterion(case),
    }
    yield "\n".join(f"- *{what}:* {escaped(words)}" for what, words in said.items())
    rows = [(result.method, *_numbers(result)) for result in run.of(case)]
    lines = ["| " + " | ".join(cells) + " |" for cells in (_HEAD, *rows)]
    yield "\n".join([lines[0], "|---" + "|--:" * len(_WIDTHS[1:]) + "|", *lines[1:]])
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
    return {
        "case": result.case.name,
        "kind": result.case.kind,
        "method": result.method,
        "criterion": result.case.criterion,
        "unit": result.case.unit,
        "measured": result.measured,
        "limit": result.limit,
        "exact": result.exact,
        "margin": result.margin,
        "cost_ratio": result.cost,
        "passed": result.passed,
        "reason": result.reason,
    }


def write(run: Run, folder: Path, command: str) -> None:
    """Write hard-cases.csv, hard-cases.md and hard-cases.png into a folder."""
    rows = list(map(_row, run.results))
    files.write_csv(folder / "hard-cases.csv", [list(rows[0]), *(row.values() for row in rows)])
    files.write_text(folder / "hard-cases.md", markdown(run, command))
    files.write_figure(folder / "hard-cases.png", figure(run), 150)
