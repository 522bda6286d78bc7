"""Reports of a run: text, Markdown, JSON and a figure."""

import json
import textwrap
from collections.abc import Iterator
from pathlib import Path

from skate_env.common import files
from skate_env.studies.accuracy.layout import EMPTY, Table, escaped, significant

from .chart import chart
from .suite import Bench
from .table import Group, Row

_WIDTH = 100
_MICRO = 1e6


def text(bench: Bench) -> str:
    """Format the run for a terminal."""
    parts = [_title(bench)]
    for group in bench.groups.values():
        parts.append(_table(group, describe=False).text())
        notes = [*_missing(group), *_notes(group)]
        parts.append("\n".join(textwrap.fill(note, _WIDTH) for note in notes))
    return "\n\n".join(parts)


def markdown(bench: Bench, command: str) -> str:
    """Format the tables as Markdown."""
    parts = [f"By `{command}`. {_title(bench)}"]
    for group in bench.groups.values():
        parts.append(f"### {group.title}")
        parts.append(_table(group, describe=True).markdown().partition("\n\n")[2])
        notes = [*_missing(group), *_notes(group)]
        parts.append("\n".join(f"- {escaped(note)}" for note in notes))
    return "\n\n".join(parts) + "\n"


def write(bench: Bench, folder: Path, command: str) -> None:
    """Write performance.md, performance.json and performance.png into a folder."""
    files.write_text(folder / "performance.md", markdown(bench, command))
    said = json.dumps(bench.summary(), indent=1, allow_nan=False)
    files.write_text(folder / "performance.json", said + "\n")
    files.write_figure(folder / "performance.png", chart(bench), 110)


def _title(bench: Bench) -> str:
    versions = ", ".join(f"{name} {it}" for name, it in bench.stamp.items() if name != "machine")
    return f"Measured in {bench.seconds:.0f} s on {bench.stamp['machine']}; {versions}."


def _table(group: Group, describe: bool) -> Table:
    """Tabulate the measured rows; with `describe`, also the tool and what was timed."""
    exact = any(row.error for row in group.rows)
    head = (
        "what",
        "time [us]",
        *(("per s",) if group.rates else ()),
        "ratio",
        *(("median error", "90 % quantile") if exact else ()),
    )
    rows = [
        (
            f"{row.case}: {row.label}",
            significant(row.time * _MICRO),
            *((_rate(row),) if group.rates else ()),
            EMPTY if row.ratio is None else significant(row.ratio),
            *(_errors(row) if exact else ()),
            *((row.tool, row.what) if describe else ()),
        )
        for row in group.rows
        if row.time is not None
    ]
    title = f"{group.title}: time of {group.unit}, and ratio to the first row of the same kind"
    return Table(title, (*head, *(("tool", "measurement") if describe else ())), rows)


def _errors(row: Row) -> tuple[str, str]:
    if row.error is None:
        return EMPTY, EMPTY
    return f"{row.error.median:.1e}", f"{row.error.tenth:.1e}"


def _rate(row: Row) -> str:
    return f"{1.0 / row.time:,.0f}" if row.time else EMPTY


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
    if group.others is not None:
        yield f"Load of other processes: {group.others:.2f} cores."
