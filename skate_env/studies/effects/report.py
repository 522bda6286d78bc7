"""Reports of the effects of a scene: text, Markdown, CSV, a chart."""

from collections.abc import Callable, Iterator
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Any

from ...common import files
from .. import report
from ..report import EMPTY, Notes, Part, Table, machine
from .chart import chart
from .study import Comparison, Row

_WIDTH = 120
_SECTIONS = {
    "unchanged": (),
    "removed": ("one effect removed:",),
    "combination": ("several effects removed:",),
    "added": ("one effect added:",),
}
# Units of columns, for the header of the CSV file.
_UNITS = {
    "simulated_time": "s",
    "evaluations_per_second": "1/s",
    "timed_over": "s",
    "instructions_per_second": "1/s",
    "time_per_evaluation": "s",
    "head_change": "m",
    "hips_change": "m",
}


@dataclass(frozen=True)
class _Column:
    group: str
    title: str
    cell: Callable[[Row], str]


def _whole(value: float | None) -> str:
    return EMPTY if value is None else f"{value:.0f}"


def _ratio(digits: int) -> Callable[[float | None], str]:
    def text(value: float | None) -> str:
        return EMPTY if value is None else f"{value:.{digits if value < 10.0 else 1}f}"

    return text


def _length(sign: str) -> Callable[[float | None], str]:
    def text(value: float | None) -> str:
        if value is None:
            return EMPTY
        if value == 0.0:
            return "0"
        return f"{value:{sign}.3f}" if abs(value) >= 0.001 else "<0.001"

    return text


_EACH, _SECOND = "cost per evaluation", "cost per sim. s"
_fine, _coarse = _ratio(3), _ratio(2)
_COLUMNS = (
    _Column("size", "dof", lambda row: _whole(row.dof)),
    _Column("size", "rows", lambda row: _whole(row.rows)),
    _Column("size", "guards", lambda row: _whole(row.guards)),
    _Column("evaluations", "per sim. s", lambda row: _whole(row.evaluations_per_second)),
    _Column("evaluations", "instr.", lambda row: _whole(row.instructions_per_evaluation)),
    _Column(_EACH, "instr.", lambda row: _fine(row.instruction_ratio_per_evaluation)),
    _Column(_EACH, "time", lambda row: _coarse(row.time_ratio_per_evaluation)),
    _Column(_EACH, "MuJoCo", lambda row: _coarse(row.mujoco_ratio)),
    _Column(_SECOND, "instr.", lambda row: _fine(row.instruction_ratio_per_second)),
    _Column(_SECOND, "time", lambda row: _coarse(row.time_ratio_per_second)),
    _Column("motion [m]", "head", lambda row: _length("")(row.head_change)),
    _Column("motion [m]", "hips", lambda row: _length("+")(row.hips_change)),
)


def title(table: Comparison) -> str:
    """Return scene, simulated time, evaluations and machine."""
    first = table.rows[0]
    assert first.time_per_evaluation is not None
    each = f"{1e6 * first.time_per_evaluation:.2f} us"
    return (
        f"Scene {table.scene}: {table.simulated_time:g} s from its start, "
        f"{first.evaluations} evaluations of {each} ({machine()})"
    )


def text(table: Comparison) -> str:
    """Format the table for a terminal."""
    return report.text([title(table), *_parts(table)], _WIDTH)


def markdown(table: Comparison, command: str) -> str:
    """Format the table as Markdown."""
    heading = f"{title(table)}, by `{command}`:"
    return report.markdown([heading, *_parts(table)])


def _parts(table: Comparison) -> tuple[Part, ...]:
    return _table(table), Notes([*notes(table), *_refused(table)])


def _table(table: Comparison) -> Table:
    """Tabulate the variants that can be compared, by kind."""
    rows: list[list[str]] = []
    sections = {}
    for kind, heading in _SECTIONS.items():
        made = [row for row in table.rows if row.kind == kind and row.reason is None]
        if made:
            sections[len(rows)] = heading
        for row in made:
            rows.append([row.label + _mark(row), *(column.cell(row) for column in _COLUMNS)])
    head = ["scene", *(column.title for column in _COLUMNS)]
    groups = ["", *(column.group for column in _COLUMNS)]
    return Table("", head, rows, groups, sections, gap=1)


def _mark(row: Row) -> str:
    """Return an asterisk if a row has remarks."""
    return "*" if any(_remarks(row)) else ""


def _remarks(row: Row) -> Iterator[str]:
    if row.reason is not None:
        return
    if row.termination is not None:
        yield (
            f"* {row.label}: ends with {row.termination} after {row.simulated_time:.3f} s; "
            "its values are those of this time"
        )
    if row.timed_over and row.simulated_time and row.timed_over < row.simulated_time:
        yield (
            f"* {row.label}: {row.evaluations} evaluations are too many to time; their cost is "
            f"measured over the first {row.timed_over:.3g} s"
        )


def notes(table: Comparison) -> Iterator[str]:
    """Explain the columns, their uncertainty and rows with remarks."""
    yield (
        "size: degrees of freedom, largest number of rows of the free foot's contact, guards. "
        "evaluations: evaluations of the right-hand side per simulated second."
    )
    instructions = table.notes.get("instructions", "counted by callgrind, whole engine")
    yield (
        "cost: ratio to the unchanged scene, below 1 is cheaper. "
        f"instr.: instructions per evaluation; {instructions}. "
        f"time: least of {table.rounds} interleaved rounds, whose halves differ by at most "
        f"{table.time_error:.1%}."
    )
    if table.mujoco_error is None:
        yield f"MuJoCo: {table.notes.get('mujoco', 'no body to compare')}."
    else:
        yield (
            f"MuJoCo: mj_step of version {table.mujoco_version} with the same bodies, no contact, "
            f"in the same rounds, whose halves differ by at most {table.mujoco_error:.1%}."
        )
    yield (
        "motion: head, the largest distance between the heads of both runs; hips, the change of "
        f"the hips' displacement ({table.hips_progress:.3f} m in the unchanged scene)."
    )
    for row in table.rows:
        yield from _remarks(row)


def _refused(table: Comparison) -> Iterator[str]:
    for row in table.rows:
        if row.reason is not None:
            yield f"{row.label}: cannot be compared; {row.reason}"


def summary(table: Comparison) -> dict[str, Any]:
    """Return all results as JSON values; None where nothing was measured."""
    return {**asdict(table), "machine": machine()}


@files.own_style
def write(table: Comparison, folder: Path, command: str) -> None:
    """Write effects.csv, effects.md and effects.png into a folder."""
    texts = {
        "effects.csv": report.as_csv(map(asdict, table.rows), _UNITS),
        "effects.md": markdown(table, command),
    }
    report.write(folder, texts, {"effects.png": chart(table)})
