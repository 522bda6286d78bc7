"""Summary figure: cost against error of every method, one panel for each motion."""

import math
from collections.abc import Iterable

import numpy as np
from matplotlib.artist import Artist
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.lines import Line2D
from matplotlib.patches import Patch

from ..fronts import front
from ..report.style import BLACK, METHODS, SKY, frame
from .chart import NAMES, inverse
from .curves import best, limit, methods, points, ratios
from .settings import NAMED
from .study import ENGINE, MUJOCO, CaseStudy, Study

_COLUMNS = 3
_MICRO = 1e6
_THEIRS = BLACK
_AREA = "#D8E6F0"
# Errors at which the ratio to MuJoCo is written, and number of points of an envelope.
_WRITTEN = (1e-3, 1e-6)
_FINE = 60
# Range of errors, the same for all motions.
_COARSEST, _FINEST = 5.0, 2e-13


def summary_figure(study: Study) -> Figure:
    """Draw the times of the engine's methods and of MuJoCo's cheapest for every motion."""
    lines = math.ceil(len(study.cases) / _COLUMNS)
    columns = min(_COLUMNS, len(study.cases))
    size = (1.6 + 3.6 * columns, 1.6 + 2.9 * lines)
    figure = Figure(figsize=size, dpi=150, layout="constrained")
    grid = figure.subplots(lines, columns, sharex=True, sharey=True, squeeze=False)
    for number, ax in enumerate(grid.flat):
        if number < len(study.cases):
            _panel(ax, study.cases[number])
        else:
            ax.set_visible(False)
    grid[0, 0].set(xscale="log", yscale="log", xlim=(_COARSEST, _FINEST))
    for ax in grid[:, 0]:
        ax.set_ylabel("time for a simulated\nsecond [us]")
    for ax in grid[:, -1]:
        right = ax.secondary_yaxis("right", functions=(inverse, inverse))
        right.set_ylabel("times faster than\nthe motion")
    for column in range(columns):
        below = [ax for ax in grid[:, column] if ax.get_visible()][-1]
        below.set_xlabel("error of the state [rad or m]")
        below.tick_params(labelbottom=True)
    figure.legend(
        handles=list(_legend(study)), loc="outside lower center", ncols=columns, frameon=False
    )
    between = "\n" if columns == 1 else " "
    figure.suptitle(
        f"Error against cost: lower is faster,{between}further to the right is more accurate"
    )
    return figure


def _panel(ax: Axes, case: CaseStudy) -> None:
    ax.set_title(case.title, fontsize=10)
    least = limit(case)
    if least is not None:
        ax.axvspan(_FINEST, max(least, _FINEST), color="#E8E8E8", zorder=0)
    for method, rows in methods(case, ENGINE).items():
        curve = [point for point in front(points(case, rows)) if point.error > (least or 0.0)]
        if curve:
            errors, times = [one.error for one in curve], [_MICRO * one.cost for one in curve]
            colour = METHODS.get(method, SKY)
            ax.plot(errors, times, color=colour, linewidth=1.8, marker=".", zorder=3)
    _mujoco(ax, case)
    for row in case.rows:
        error, time = row.errors.position, row.time
        if row.method == NAMED and least is not None and None not in (error, time):
            assert error is not None and time is not None
            place = max(error, least), _MICRO * time
            ax.plot(*place, marker="o", markersize=9, fillstyle="none", color="#000000", zorder=5)
            above = row.label == "reference"
            ax.annotate(
                row.label,
                place,
                xytext=(0, 8) if above else (0, -15),
                ha="center",
                textcoords="offset points",
                fontsize=8,
                fontweight="bold",
                zorder=6,
            )
    frame(ax)


def _mujoco(ax: Axes, case: CaseStudy) -> None:
    """Draw MuJoCo's lower envelope, the area down to the engine's, and their ratios."""
    found = [
        point.error
        for rows in methods(case, MUJOCO).values()
        for point in front(points(case, rows))
    ]
    if not found:
        return
    errors = np.geomspace(min(_COARSEST, max(found)), min(found) * 1.000001, _FINE)
    theirs = [one.cost if (one := best(case, MUJOCO, error)) else np.nan for error in errors]
    ours = [one.cost if (one := best(case, ENGINE, error)) else np.nan for error in errors]
    above, below = _MICRO * np.array(theirs), _MICRO * np.array(ours)
    ax.plot(errors, above, color=_THEIRS, linewidth=1.8, zorder=3)
    ax.fill_between(errors, below, above, where=above > below, color=_AREA, zorder=1)
    for ratio in ratios(case, _WRITTEN):
        value = ratio.value
        if value is not None and ratio.ours and ratio.theirs:
            ends = [_MICRO * ratio.ours.cost, _MICRO * ratio.theirs.cost]
            ax.plot([ratio.error] * 2, ends, color="0.35", linewidth=0.8, zorder=2)
            ax.annotate(
                f"{value:.2g}x" if value < 100.0 else f"{value:.0f}x",
                (ratio.error, max(ends)),
                xytext=(-3, 3),
                textcoords="offset points",
                ha="right",
                fontsize=9,
                zorder=6,
                bbox={"facecolor": "white", "edgecolor": "none", "pad": 0.5, "alpha": 0.7},
            )


def _legend(study: Study) -> Iterable[Artist]:
    seen = dict.fromkeys(method for case in study.cases for method in methods(case, ENGINE))
    for method in seen:
        colour = METHODS.get(method, SKY)
        yield Line2D(
            [], [], color=colour, linewidth=1.8, marker=".", label=NAMES.get(method, method)
        )
    if any(methods(case, MUJOCO) for case in study.cases):
        yield Line2D([], [], color=_THEIRS, linewidth=1.8, label="MuJoCo, cheapest method")
        yield Patch(color=_AREA, label="number: time of MuJoCo / skate_env")
