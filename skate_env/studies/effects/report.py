"""Reports of the effects of a scene: text, Markdown, CSV, a chart."""

import textwrap
from collections.abc import Callable, Iterator
from dataclasses import asdict, dataclass, fields
from pathlib import Path
from typing import Any

from matplotlib.artist import Artist
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.lines import Line2D
from matplotlib.patches import Patch

from ...common import files, literal
from ..versions import machine
from .study import Comparison, Row

_WIDTH = 120
_SECTIONS = {
    "unchanged": "",
    "removed": "one effect removed",
    "combination": "several effects removed",
    "added": "one effect added",
}
_EMPTY = "-"
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
    width: int
    cell: Callable[[Row], str]


def _whole(value: float | None) -> str:
    return _EMPTY if value is None else f"{value:.0f}"


def _ratio(digits: int) -> Callable[[float | None], str]:
    def text(value: float | None) -> str:
        return _EMPTY if value is None else f"{value:.{digits if value < 10.0 else 1}f}"

    return text


def _length(sign: str) -> Callable[[float | None], str]:
    def text(value: float | None) -> str:
        if value is None:
            return _EMPTY
        if value == 0.0:
            return "0"
        return f"{value:{sign}.3f}" if abs(value) >= 0.001 else "<0.001"

    return text


_EACH = "cost per evaluation"
_fine, _coarse = _ratio(3), _ratio(2)
_COLUMNS = (
    _Column("size", "dof", 5, lambda row: _whole(row.dof)),
    _Column("size", "rows", 5, lambda row: _whole(row.rows)),
    _Column("size", "guards", 7, lambda row: _whole(row.guards)),
    _Column("evaluations", "per sim. s", 12, lambda row: _whole(row.evaluations_per_second)),
    _Column("evaluations", "instr.", 8, lambda row: _whole(row.instructions_per_evaluation)),
    _Column(_EACH, "instr.", 8, lambda row: _fine(row.instruction_ratio_per_evaluation)),
    _Column(_EACH, "time", 6, lambda row: _coarse(row.time_ratio_per_evaluation)),
    _Column(_EACH, "MuJoCo", 8, lambda row: _coarse(row.mujoco_ratio)),
    _Column("cost per sim. s", "instr.", 9, lambda row: _fine(row.instruction_ratio_per_second)),
    _Column("cost per sim. s", "time", 7, lambda row: _coarse(row.time_ratio_per_second)),
    _Column("motion [m]", "head", 8, lambda row: _length("")(row.head_change)),
    _Column("motion [m]", "hips", 8, lambda row: _length("+")(row.hips_change)),
)
_LABEL = 29


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
    lines = [title(table), ""]
    groups = list(dict.fromkeys(column.group for column in _COLUMNS))
    head = " " * _LABEL
    for group in groups:
        width = sum(column.width for column in _COLUMNS if column.group == group)
        head += " " + group.center(width - 1, "-")
    lines += [head, " " * _LABEL + "".join(c.title.rjust(c.width) for c in _COLUMNS)]
    for kind, heading in _SECTIONS.items():
        rows = [row for row in table.rows if row.kind == kind and row.reason is None]
        if rows:
            lines += [""] * (heading != "") + [f"{heading}:"] * (heading != "")
            lines += [_line(row) for row in rows]
    refused = [row for row in table.rows if row.reason is not None]
    if refused:
        lines += ["", "cannot be compared:"]
        lines += [_wrapped(f"{row.label:<{_LABEL}} {row.reason}") for row in refused]
    lines.append("")
    lines += [textwrap.fill(note, _WIDTH, subsequent_indent="  ") for note in notes(table)]
    return "\n".join(lines)


def _line(row: Row) -> str:
    cells = "".join(column.cell(row).rjust(column.width) for column in _COLUMNS)
    return (row.label + _mark(row)).ljust(_LABEL) + cells


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


def _wrapped(line: str) -> str:
    return textwrap.fill(line, _WIDTH, subsequent_indent=" " * (_LABEL + 1))


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


def markdown(table: Comparison, command: str) -> str:
    """Format the table as Markdown."""
    head = ["scene", *(f"{c.group}: {c.title}" for c in _COLUMNS)]
    lines = [f"{title(table)}, by `{command}`:", ""]
    lines += ["| " + " | ".join(head) + " |", "|---" + "|--:" * len(_COLUMNS) + "|"]
    for row in table.rows:
        if row.reason is None:
            lines.append(
                "| "
                + " | ".join([_escaped(row.label + _mark(row)), *(c.cell(row) for c in _COLUMNS)])
                + " |"
            )
    lines.append("")
    lines += [f"- {_escaped(note)}" for note in notes(table)]
    refused = [row for row in table.rows if row.reason is not None]
    lines += [f"- {row.label}: cannot be compared; {row.reason}" for row in refused]
    return "\n".join(lines) + "\n"


def _escaped(words: str) -> str:
    return words.replace("*", r"\*").replace("<", r"\<")


def summary(table: Comparison) -> dict[str, Any]:
    """Return all results as JSON values; None where nothing was measured."""
    return {**asdict(table), "machine": machine()}


def write(table: Comparison, folder: Path, command: str) -> None:
    """Write effects.csv, effects.md and effects.png into a folder."""
    names = [item.name for item in fields(Row)]
    header = [f"{name} [{_UNITS[name]}]" if name in _UNITS else name for name in names]
    rows = (asdict(row).values() for row in table.rows)
    files.write_csv(folder / "effects.csv", [header, *rows])
    files.write_text(folder / "effects.md", markdown(table, command))
    files.write_figure(folder / "effects.png", chart(table), 150)


# Palette of Okabe and Ito, suitable for colour-blind readers.
_COLOURS = {"removed": "#0072B2", "combination": "#56B4E9", "added": "#E69F00"}
_INSTRUCTIONS: dict[str, Any] = {
    "marker": "|",
    "color": "#000000",
    "markersize": 14,
    "markeredgewidth": 2,
}
_MUJOCO: dict[str, Any] = {"marker": "D", "color": "#D55E00", "markersize": 5}
# Longer bars are cut and labelled.
_LONGEST_BAR = 1.6


def chart(table: Comparison) -> Figure:
    """Draw the cost of every variant: a bar for time, a tick for instructions."""
    rows = [row for row in table.rows if row.reason is None and row.kind in _COLOURS]
    figure = Figure(figsize=(10.5, 1.9 + 0.27 * len(rows)), layout="constrained")
    left, right = figure.subplots(1, 2, sharey=True)
    for place, row in enumerate(rows):
        colour = _COLOURS[row.kind]
        each = (row.time_ratio_per_evaluation, row.instruction_ratio_per_evaluation)
        _bar(left, place, colour, *each)
        if row.mujoco_ratio is not None:
            left.plot([row.mujoco_ratio], [place], linestyle="none", **_MUJOCO)
        _bar(right, place, colour, row.time_ratio_per_second, row.instruction_ratio_per_second)
    for ax, what in ((left, "one evaluation of the dynamics"), (right, "one simulated second")):
        ax.axvline(1.0, color="0.3", linewidth=1.0, zorder=3)
        ax.set(xlim=(0.0, _LONGEST_BAR), xlabel=f"cost of {what}\n[ratio to the unchanged scene]")
        ax.grid(axis="x", color="0.92")
        ax.set_axisbelow(True)
        ax.spines[["top", "right"]].set_visible(False)
    left.set_yticks(range(len(rows)), [row.label for row in rows])
    left.set_ylim(len(rows) - 0.4, -0.6)
    present = [kind for kind in _COLOURS if any(row.kind == kind for row in rows)]
    legend: list[Artist] = [Patch(color=_COLOURS[kind], label=f"time, {kind}") for kind in present]
    if any(row.instruction_ratio_per_evaluation is not None for row in rows):
        legend.append(Line2D([], [], linestyle="none", label="instructions", **_INSTRUCTIONS))
    if any(row.mujoco_ratio is not None for row in rows):
        legend.append(Line2D([], [], linestyle="none", label="time of MuJoCo's step", **_MUJOCO))
    figure.legend(handles=legend, loc="outside lower center", ncols=len(legend), frameon=False)
    figure.suptitle(f"Cost of effects: scene {literal(table.scene)}, left of the line is cheaper")
    return figure


def _bar(ax: Axes, place: int, colour: str, time: float | None, count: float | None) -> None:
    """Draw one bar; `count` is the ratio of instructions."""
    assert time is not None
    ax.barh(place, min(time, _LONGEST_BAR), height=0.62, color=colour)
    if count is not None and count < _LONGEST_BAR:
        ax.plot([count], [place], linestyle="none", **_INSTRUCTIONS)
    if time > _LONGEST_BAR:
        box = {"facecolor": "white", "edgecolor": "none", "pad": 1.5}
        ax.text(0.97 * _LONGEST_BAR, place, f"{time:.3g}", ha="right", va="center", bbox=box)
