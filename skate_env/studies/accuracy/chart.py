"""Figures of the study: error against cost, one figure for each motion."""

import math
from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from matplotlib.artist import Artist
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.lines import Line2D

from ..report.style import BLACK, METHODS, VERMILION, frame
from .curves import limit, methods
from .prices import case_orders
from .settings import NAMED
from .study import ENGINE, MUJOCO, CaseStudy, Row

NAMES = {
    "dop853": "dop853: explicit, order 8, adaptive steps",
    "dopri5": "dopri5: explicit, order 5, adaptive steps",
    "rk4": "rk4: explicit, fixed steps",
    "rosenbrock": "rosenbrock: linearly implicit, adaptive steps",
    "moreau": "moreau: time-stepping, fixed steps",
}
_MARKERS = {"dop853": "o", "dopri5": "v", "rk4": "s", "rosenbrock": "D", "moreau": "^"}
# Other tools are grey.
_OTHERS = (BLACK, "#777777")
_OTHER_MARKERS = ("x", "+", "1", "2", "3", "4", "|", "_")
_DASHES: tuple[Any, ...] = ("-", "--", "-.", ":")
# Dash and gap of the line for the distance to a method's own limit.
_LIMIT = (8, 4)
_BAND = "#E8E8E8"
_UPPER_BOUND: dict[str, Any] = {"marker": "v", "markerfacecolor": "white"}
# Offsets and alignments of the accuracies' names [points].
_PLACES = {
    "fast": ((-9, -12), "right"),
    "balanced": ((-9, -12), "right"),
    "reference": ((10, -17), "center"),
}
_LABELS = {
    "position": "error of the final state\n[rad or m]",
    "slide": "error of the slide distance\n[m]",
}
_MICRO = 1e6


@dataclass(frozen=True)
class Style:
    """Line and marker style of a method."""

    colour: str
    marker: str
    dash: Any
    width: float

    @property
    def line(self) -> dict[str, Any]:
        """Arguments of a line."""
        return {"color": self.colour, "linewidth": self.width, "linestyle": self.dash}


def style(tool: str, method: str, number: int) -> Style:
    """Choose colour, marker and dash of a method, the ``number``-th of its tool."""
    if tool == ENGINE:
        return Style(METHODS.get(method, VERMILION), _MARKERS.get(method, "P"), "-", 1.8)
    colour = _OTHERS[number % 2]
    return Style(
        colour, _OTHER_MARKERS[number % len(_OTHER_MARKERS)], _DASHES[number // 2 % 4], 1.0
    )


def case_figure(case: CaseStudy) -> Figure:
    """Draw errors of the state and of the slide distance against time and evaluations."""
    quantities = ("position",) if case.smooth else ("position", "slide")
    handles = _legend(case)
    # Long names fit into two columns only.
    columns = 2 if max(len(str(one.get_label())) for one in handles) > 50 else 3
    below = 0.21 * math.ceil(len(handles) / columns)
    size = (11.0, 1.2 + 3.9 * len(quantities) + below)
    figure = Figure(figsize=size, dpi=110, layout="constrained")
    grid = figure.subplots(len(quantities), 2, sharex="col", sharey="row", squeeze=False)
    for line, quantity in zip(grid, quantities, strict=True):
        for ax, cost in zip(line, ("time", "evaluations"), strict=True):
            _panel(ax, case, quantity, cost)
        line[0].set_ylabel(_LABELS[quantity])
    grid[-1, 0].set_xlabel("time per simulated second [us]")
    grid[-1, 1].set_xlabel("evaluations of the dynamics per simulated second")
    _real_time(grid[0, 0])
    figure.legend(
        handles=handles, loc="outside lower center", ncols=columns, frameon=False, fontsize=9
    )
    starts = "one start" if case.starts == 1 else f"root mean square of {case.starts} starts"
    figure.suptitle(f"Error against cost\n{case.title} ({case.duration:g} s, {starts})")
    return figure


def _panel(ax: Axes, case: CaseStudy, quantity: str, cost: str) -> None:
    ax.set(xscale="log", yscale="log")
    ax.margins(x=0.1)
    least = limit(case, quantity)
    tools = (ENGINE, MUJOCO) if cost == "time" else (ENGINE,)
    crosses: list[tuple[float, str]] = []
    for tool in tools:
        for number, (method, rows) in enumerate(methods(case, tool).items()):
            line_style = style(tool, method, number)
            _curve(ax, rows, quantity, cost, line_style, least)
            _to_limit(ax, rows, quantity, cost, line_style)
            failed = (row for row in rows if row.failures)
            crosses += [(x, line_style.colour) for row in failed if (x := _cost(row, rows, cost))]
    _named(ax, case, quantity, cost, least)
    _frame(ax, case, quantity, crosses, least)


def _cost(row: Row, others: Iterable[Row], cost: str) -> float | None:
    """Return a cost in the figure's units; that of a failed run with fixed steps is scaled."""
    scale = _MICRO if cost == "time" else 1.0
    value: float | None = getattr(row, cost)
    if row.failures and row.fixed_step and row.value:
        # The cost of fixed steps does not depend on the motion.
        sound = [
            known * other.value / row.value
            for other in others
            if not other.failures and other.value and (known := getattr(other, cost))
        ]
        value = min(sound, default=value)
    return None if value is None else scale * value


def _curve(
    ax: Axes, rows: Sequence[Row], quantity: str, cost: str, line_style: Style, least: float | None
) -> None:
    """Draw the settings of a method; untrusted errors are hollow markers at the band's edge."""
    xs, ys, hollow = [], [], []
    for row in rows:
        x, y = _cost(row, rows, cost), getattr(row.errors, quantity)
        if x is None or y is None or least is None or max(y, least) <= 0.0:
            continue
        xs.append(x)
        ys.append(max(y, least))
        hollow.append(not row.trusted.get(quantity, False))
    if not xs:
        return
    # The line ends at the first point on the edge.
    shown = [i for i, empty in enumerate(hollow) if not empty or (i > 0 and not hollow[i - 1])]
    ax.plot([xs[i] for i in shown], [ys[i] for i in shown], zorder=3, **line_style.line)
    points: dict[str, Any] = {"linestyle": "none", "color": line_style.colour, "markersize": 5}
    for empty, look in ((False, {"marker": line_style.marker}), (True, _UPPER_BOUND)):
        at = [i for i, other in enumerate(hollow) if other is empty]
        ax.plot([xs[i] for i in at], [ys[i] for i in at], zorder=4, **look, **points)


def _to_limit(ax: Axes, rows: Sequence[Row], quantity: str, cost: str, line_style: Style) -> None:
    """Draw the distance of a method from its own limit for fine steps."""
    places = [
        (x, y)
        for row in rows
        if row.to_limit is not None
        and (x := _cost(row, rows, cost)) is not None
        and (y := getattr(row.to_limit, quantity))
    ]
    if places:
        ax.plot(*zip(*places, strict=True), color=line_style.colour, dashes=_LIMIT, linewidth=0.7)


def _named(ax: Axes, case: CaseStudy, quantity: str, cost: str, least: float | None) -> None:
    """Mark the named accuracies with rings and names."""
    for row in case.rows:
        x, y = _cost(row, (), cost), getattr(row.errors, quantity)
        if row.method != NAMED or x is None or y is None or least is None or max(y, least) <= 0.0:
            continue
        if y <= least:
            ax.plot([x], [least], marker="v", markersize=5, fillstyle="none", color="#000000")
        y = max(y, least)
        ax.plot([x], [y], marker="o", markersize=11, fillstyle="none", color="#000000", zorder=5)
        place, side = _PLACES.get(row.label, ((8, 8), "left"))
        ax.annotate(
            row.label,
            (x, y),
            xytext=place,
            ha=side,
            textcoords="offset points",
            fontsize=9,
            fontweight="bold",
            zorder=6,
            bbox={"facecolor": "white", "edgecolor": "none", "alpha": 0.75, "pad": 0.8},
        )


def _frame(
    ax: Axes,
    case: CaseStudy,
    quantity: str,
    crosses: Sequence[tuple[float, str]],
    least: float | None,
) -> None:
    """Set the axis limits; draw the band of untrusted errors and the strip of failures."""
    known = [
        error
        for row in case.rows
        if not row.failures and (error := getattr(row.errors, quantity)) and error > (least or 0.0)
    ]
    bottom = least or min(known, default=1e-12)
    top = 10.0 * max(known, default=1.0)
    low = bottom / 60.0
    # The strip is the top twelfth.
    high = low * (top / low) ** (12.0 / 11.0)
    ax.set_ylim(low, high)
    ax.axhspan(low, bottom, color=_BAND, zorder=0)
    words = "smaller than the references are sure of" if least is not None else "unknown"
    place = ax.get_yaxis_transform()
    ax.text(0.015, 1.5 * low, words, color="0.35", fontsize=8, va="bottom", transform=place)
    if crosses:
        ax.axhspan(top, high, color="#FBE9E0", zorder=0)
        middle = float(np.sqrt(top * high))
        for x, colour in crosses:
            ax.plot([x], [middle], marker="X", markersize=7, color=colour, zorder=5, linestyle="")
    frame(ax)


def inverse(x: Any) -> Any:
    """Convert microseconds per simulated second to the real-time factor, and back."""
    return _MICRO / np.maximum(x, 1e-12)


def _real_time(ax: Axes) -> None:
    """Add an axis with the real-time factor above a panel of times."""
    above = ax.secondary_xaxis("top", functions=(inverse, inverse))
    above.set_xlabel("real-time factor", fontsize=9)
    above.tick_params(labelsize=8)


def _legend(case: CaseStudy) -> list[Artist]:
    measured = {(order.tool, order.method): order.order for order in case_orders(case)}
    handles: list[Artist] = []
    for tool in (ENGINE, MUJOCO):
        for number, method in enumerate(methods(case, tool)):
            line_style = style(tool, method, number)
            label = NAMES.get(method, method) if tool == ENGINE else f"MuJoCo: {method}"
            if (tool, method) in measured:
                label += f" (order {measured[tool, method]:.1f})"
            point: dict[str, Any] = {"marker": line_style.marker, "markersize": 5}
            handles.append(Line2D([], [], label=label, **point, **line_style.line))
    points: dict[str, Any] = {"linestyle": "none", "color": "0.3"}
    handles.append(Line2D([], [], label="upper bound", **_UPPER_BOUND, **points))
    if any(row.to_limit for row in case.rows):
        words = "default contact: distance to its own limit"
        handles.append(Line2D([], [], color="0.3", linewidth=0.7, dashes=_LIMIT, label=words))
    if any(row.failures for row in case.rows):
        words = "fails, or has other contact states"
        handles.append(Line2D([], [], marker="X", label=words, **points))
    return handles
