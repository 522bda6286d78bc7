"""Chart of the cost of every effect."""

from typing import Any

from matplotlib.artist import Artist
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.lines import Line2D
from matplotlib.patches import Patch

from ...common import literal
from ..report.style import BLACK, BLUE, ORANGE, SKY, VERMILION, frame
from .study import Comparison

_COLOURS = {"removed": BLUE, "combination": SKY, "added": ORANGE}
_INSTRUCTIONS: dict[str, Any] = {
    "marker": "|",
    "color": BLACK,
    "markersize": 14,
    "markeredgewidth": 2,
}
_MUJOCO: dict[str, Any] = {"marker": "D", "color": VERMILION, "markersize": 5}
# Longer bars are cut and labelled.
_LONGEST_BAR = 1.6


def chart(table: Comparison) -> Figure:
    """Draw the cost of every variant: a bar for time, a tick for instructions."""
    rows = [row for row in table.rows if row.reason is None and row.kind in _COLOURS]
    figure = Figure(figsize=(10.5, 1.9 + 0.27 * len(rows)), dpi=150, layout="constrained")
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
        frame(ax, "x")
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
