"""Reports of a run: text, Markdown, JSON and a figure."""

from collections.abc import Iterator
from pathlib import Path

from skate_env.studies import report
from skate_env.studies.report import (
    EMPTY,
    Heading,
    Notes,
    Part,
    Table,
    described,
    scientific,
    significant,
)

from .chart import chart
from .suite import Bench
from .table import Group

_MICRO = 1e6


def text(bench: Bench) -> str:
    """Format the run for a terminal."""
    tables = [part for group in bench.groups.values() for part in _parts(group)]
    return report.text([_title(bench), *tables])


def markdown(bench: Bench, command: str) -> str:
    """Format the tables as Markdown, with the tools and what was timed."""
    parts: list[Part] = [f"By `{command}`. {_title(bench)}"]
    for group in bench.groups.values():
        parts += [Heading(group.title), *_parts(group, describe=True)]
    return report.markdown(parts)


def write(bench: Bench, folder: Path, command: str) -> None:
    """Write performance.md, performance.json and performance.png into a folder."""
    texts = {
        "performance.md": markdown(bench, command),
        "performance.json": report.as_json(bench.summary()),
    }
    report.write(folder, texts, {"performance.png": chart(bench)})


def _title(bench: Bench) -> str:
    return f"Measured in {bench.seconds:.0f} s; {described(bench.stamp)}."


def _parts(group: Group, describe: bool = False) -> tuple[Part, ...]:
    return _table(group, describe), Notes([*_missing(group), *_notes(group)])


def _table(group: Group, describe: bool) -> Table:
    """Tabulate the measured rows; with `describe`, also the tool and what was timed."""
    measured = [row for row in group.rows if row.time is not None]
    columns = {
        "what": [f"{row.case}: {row.label}" for row in measured],
        "time [us]": [significant(_MICRO * (row.time or 0.0)) for row in measured],
    }
    if group.rates:
        columns["per s"] = [f"{1.0 / row.time:,.0f}" if row.time else EMPTY for row in measured]
    columns["ratio"] = [significant(row.ratio) for row in measured]
    if any(row.error for row in group.rows):
        columns["median error"] = [scientific(row.error and row.error.median) for row in measured]
        columns["90 % quantile"] = [scientific(row.error and row.error.tenth) for row in measured]
    if describe:
        columns["tool"] = [row.tool for row in measured]
        columns["measurement"] = [row.what for row in measured]
    title = f"{group.title}: time of {group.unit}, and ratio to the first row of the same kind"
    rows = list(zip(*columns.values(), strict=True))
    return Table("" if describe else title, tuple(columns), rows)


def _missing(group: Group) -> Iterator[str]:
    for row in group.rows:
        if row.reason is not None:
            yield f"{row.case}: {row.label}: not measured; {row.reason}."


def _notes(group: Group) -> Iterator[str]:
    yield from group.notes
    if group.rounds:
        yield (
            f"Times: least of {group.rounds} interleaved rounds at most; halves differ by up to "
            f"{group.time_error:.1%}."
        )
