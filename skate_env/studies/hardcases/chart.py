"""Chart of all margins: a row for each case, a marker for each method."""

import math
from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass
from typing import Any

from matplotlib.artist import Artist
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.lines import Line2D

from ..report.style import METHODS as COLOURS
from .case import METHODS
from .runner import Result, Run

# Colours of the accuracy study; `reference`, with the method of `balanced`, has that of `dopri5`.
_STYLES = {
    "balanced": (COLOURS["dop853"], "o"),
    "reference": (COLOURS["dopri5"], "v"),
    "fast": (COLOURS["moreau"], "^"),
    "rosenbrock": (COLOURS["rosenbrock"], "D"),
    "rk4": (COLOURS["rk4"], "s"),
}
_MARKER: dict[str, Any] = {
    "markersize": 5.5,
    "markeredgecolor": "white",
    "markeredgewidth": 0.5,
    "linestyle": "none",
}
_FAILURE: dict[str, Any] = {
    "marker": "o",
    "color": "#D00000",
    "fillstyle": "none",
    "markersize": 11,
    "markeredgewidth": 1.8,
    "linestyle": "none",
}
_EXACT, _NOTHING, _STRIPE = "#DCE9E0", "#FBE9E0", "#F4F4F4"
# Limits of the axis [decades]; values beyond them are drawn at its ends.
_LEAST, _MOST = -4, 10
# Space beyond the outermost decades [decades]; width of a strip as a share of the range.
_SPACE, _STRIP = 0.5, 0.16
# Height of a row, and of everything else [in].
_ROW, _REST = 0.28, 1.7
# Markers closer than this share of the range are stacked, with this vertical distance [rows].
_CLOSE, _APART = 0.014, 0.19


@dataclass(frozen=True)
class _Scale:
    """Horizontal scale: decades of the margin, with strips for results without a finite margin."""

    low: int
    """Lowest decade with a tick."""
    high: int
    """Highest decade with a tick."""
    numbers: bool
    """Whether all failures have a margin; otherwise there is a strip for them."""

    @property
    def strip(self) -> float:
        """Width of the strips at the edges."""
        return _STRIP * (self.high - self.low)

    @property
    def edges(self) -> tuple[float, float, float, float]:
        """Left and right edge of the left strip, then of the right strip."""
        left, right = self.low - _SPACE, self.high + _SPACE
        return left - (0.0 if self.numbers else self.strip), left, right, right + self.strip

    def place(self, result: Result) -> float:
        """Position of a result; in the strips each method has its own position."""
        slot = self.strip * (list(METHODS).index(result.method) + 1) / (len(METHODS) + 1)
        if result.exact:
            return self.edges[2] + slot
        if not result.margin:
            return self.edges[0] + slot
        return min(max(math.log10(result.margin), self.low), self.high)


def figure(run: Run) -> Figure:
    """Draw the margins of all results, on a logarithmic scale."""
    rows = len(run.cases) + len(run.kinds())
    picture = Figure(figsize=(10.5, _REST + _ROW * rows), dpi=150, layout="constrained")
    ax, scale, row = picture.subplots(), _scale(run.results), 0
    names: dict[int, str] = {}
    _frame(ax, scale, run.results)
    for kind, cases in run.kinds().items():
        box = {"facecolor": "white", "edgecolor": "none", "pad": 2.0}
        ax.text(scale.edges[0], row, kind, va="center", fontweight="bold", zorder=5, bbox=box)
        for number, case in enumerate(cases):
            row += 1
            names[row] = case.name
            if number % 2 == 0:
                ax.axhspan(row - 0.5, row + 0.5, color=_STRIPE, zorder=0)
            _row(ax, scale, row, run.of(case))
        row += 1
    ax.set_yticks(list(names), list(names.values()))
    ax.set_ylim(rows - 0.4, -0.7)
    legend = list(_legend(run))
    picture.legend(handles=legend, loc="outside lower center", ncols=len(legend), frameon=False)
    picture.suptitle("Hard cases: margin to the limit (larger is better)")
    return picture


def _scale(results: Iterable[Result]) -> _Scale:
    decades = [math.log10(result.margin) for result in results if result.margin]
    low = math.floor(min([*decades, 0.0]))
    high = math.ceil(max([*decades, 1.0]))
    numbers = all(result.exact or result.margin for result in results)
    return _Scale(max(low, _LEAST), min(high, _MOST), numbers)


def _row(ax: Axes, scale: _Scale, row: int, results: Sequence[Result]) -> None:
    """Draw the results of a case; overlapping markers are stacked."""
    group: list[tuple[float, Result]] = []
    for place, result in sorted(
        ((scale.place(result), result) for result in results), key=lambda pair: pair[0]
    ):
        if group and place - group[-1][0] > _CLOSE * (scale.high - scale.low):
            _group(ax, row, group)
            group = []
        group.append((place, result))
    _group(ax, row, group)


def _group(ax: Axes, row: int, group: Sequence[tuple[float, Result]]) -> None:
    for number, (x, result) in enumerate(group):
        y = row + _APART * (number - 0.5 * (len(group) - 1))
        colour, marker = _STYLES[result.method]
        ax.plot([x], [y], marker=marker, color=colour, zorder=4, **_MARKER)
        if not result.passed:
            ax.plot([x], [y], zorder=5, **_FAILURE)


def _frame(ax: Axes, scale: _Scale, results: Iterable[Result]) -> None:
    """Draw the limit, the decades and both strips."""
    first, left, right, last = scale.edges
    ticks: dict[float, str] = {n: f"$10^{{{n}}}$" for n in range(scale.low, scale.high + 1)}
    ticks[0] = "limit\n1"
    for edge, word, side in ((scale.low, "below", -1), (scale.high, "above", 1)):
        if any(r.margin and side * (math.log10(r.margin) - edge) > 0.0 for r in results):
            ticks[edge] = f"{word}\n{ticks[edge]}"
    for decade in ticks:
        ax.axvline(decade, color="0.9", linewidth=0.8, zorder=1)
    ax.axvline(0.0, color="0.2", linewidth=1.4, zorder=3)
    ax.axvspan(right, last, color=_EXACT, zorder=0.5)
    ticks[0.5 * (right + last)] = "exact:\nmeasured 0"
    if not scale.numbers:
        ax.axvspan(first, left, color=_NOTHING, zorder=0.5)
        ticks[0.5 * (first + left)] = "fails,\nno margin"
    ax.set_xticks(list(ticks), list(ticks.values()))
    ax.tick_params(axis="x", top=True, labeltop=True, length=0)
    ax.tick_params(axis="y", length=0)
    ax.set(xlim=(first, last), xlabel="margin: limit / measured value")
    ax.spines[:].set_visible(False)


def _legend(run: Run) -> Iterator[Artist]:
    for method in run.methods:
        colour, marker = _STYLES[method]
        yield Line2D([], [], marker=marker, color=colour, label=method, **_MARKER)
    if not run.passed:
        yield Line2D([], [], label="fails", **_FAILURE)
