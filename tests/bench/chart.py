"""Figure of a benchmark run."""

from collections.abc import Sequence

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.ticker import NullFormatter

from skate_env.studies.fixtures import name_of
from skate_env.studies.report.style import (
    BLACK,
    BLUE,
    GREY,
    METHODS,
    ORANGE,
    SKY,
    VERMILION,
    frame,
)

from . import environments as envs
from . import equal_steps, evaluations, scaling, steps, suite
from .states import EVALUATED, STEP, STEPPED
from .suite import Bench
from .table import OURS, Group, Row

_COLOURS = {
    OURS: BLUE,
    steps.BATCH: SKY,
    evaluations.MUJOCO: VERMILION,
    evaluations.MUJOCO_SOLVED: ORANGE,
    "Pinocchio": GREY,
    "MuJoCo, Euler": VERMILION,
    "MuJoCo, implicitfast": ORANGE,
    "MuJoCo, RK4": GREY,
}
_MICRO = 1e6


def chart(bench: Bench) -> Figure:
    """Draw evaluations, steps, environments, their scaling, and cost against error."""
    groups = bench.groups
    by_error = groups.get(suite.EQUAL_STEPS)
    rows = 2 if by_error is None else 3
    figure = Figure(figsize=(16.0, 4.5 * rows), dpi=110, layout="constrained")
    # Separate subfigures, so that long labels do not shrink other rows.
    grid = figure.add_gridspec(rows, 1)
    upper, lower, *last = (figure.add_subfigure(grid[i]).subplots(1, 3) for i in range(rows))
    _bars(upper[0], groups[suite.EVALUATIONS], [kind.name for kind in EVALUATED])
    upper[0].set_title("One evaluation of the dynamics, and ratio to IceSkate")
    _bars(upper[1], groups[suite.STEPS], [kind.name for kind in STEPPED])
    upper[1].set_title(f"One step of {1e3 * STEP:g} ms, and ratio to IceSkate")
    _rates(upper[2], groups[suite.ENVIRONMENTS])
    _number(lower[0], groups[suite.MORE_ENVIRONMENTS])
    _threads(lower[1], groups[suite.MORE_THREADS])
    _freedom(lower[2], groups[suite.MORE_FREEDOM])
    axes = [*upper, *lower]
    if by_error is not None:
        for ax, scene in zip(last[0], envs.SCENES, strict=True):
            _errors(ax, by_error, scene)
        axes += [*last[0]]
    for ax in axes:
        frame(ax)
    figure.suptitle(f"IceSkate and other simulators on {bench.stamp['machine']}, one run")
    return figure


def _bars(ax: Axes, group: Group, cases: Sequence[str]) -> None:
    """Draw a cluster of bars for every case, each with its ratio to IceSkate."""
    named: set[str] = set()
    for place, case in enumerate(cases):
        rows = group.of(case)
        for k, row in enumerate(rows):
            x = place + 0.8 * ((k + 0.5) / len(rows) - 0.5)
            label = None if row.label in named else row.label
            named.add(row.label)
            height = _MICRO * (row.time or 0.0)
            ax.bar(x, height, 0.74 / len(rows), color=_COLOURS[row.label], label=label)
            if k and row.ratio is not None:
                # Ratios of low bars are rotated because the bars are close together.
                turn = 90 if row.ratio < 1.0 else 0
                ax.annotate(
                    f"{row.ratio:.2g}",
                    (x, height),
                    (0, 1),
                    textcoords="offset points",
                    ha="center",
                    va="bottom",
                    fontsize=8,
                    rotation=turn,
                )
    ax.set_xticks(range(len(cases)), [case.replace(" ", "\n") for case in cases])
    ax.set(ylabel="time [us]")
    ax.margins(y=0.35)
    ax.legend(frameon=False, fontsize=8, ncols=2, loc="upper left")


def _rates(ax: Axes, group: Group) -> None:
    """Draw environment steps per second."""
    entries = [(row, a) for a in envs.ACCURACIES for row in group.of(envs.case_of(a))]
    # MuJoCo's environment stands in the cases of both accuracies.
    entries = [one for one in entries if one[0].tool == OURS or one[1] == "fast"]
    entries.sort(key=lambda one: -(one[0].time or 0.0))
    rows = [row for row, _ in entries]
    places = range(len(rows))
    rates = [1.0 / (row.time or np.nan) for row in rows]
    ax.barh(places, rates, color=[_colour(row) for row in rows])
    for place, rate in zip(places, rates, strict=True):
        ax.annotate(f" {rate:,.0f}", (rate, place), va="center", fontsize=8)
    names = [f"{row.label}, {a}" if row.tool == OURS else row.label for row, a in entries]
    ax.set_yticks(places, names, fontsize=8)
    ax.set(xscale="log", xlabel="environment steps per second and core")
    ax.set_xlim(min(rates) / 3.0, max(rates) * 6.0)
    ax.set_title("Environments, one thread")


def _colour(row: Row) -> str:
    return BLUE if row.tool == OURS else VERMILION if "same body" in row.label else GREY


def _number(ax: Axes, group: Group) -> None:
    rows = group.of(scaling.ENVIRONMENTS)
    sizes = [row.size or np.nan for row in rows]
    ax.plot(sizes, [_MICRO * (row.time or np.nan) for row in rows], "o-", color=BLUE)
    ax.set(xscale="log", ylim=(0.0, None), xlabel="environments of a batch, one thread")
    ax.set_xticks(sizes, [f"{size:.0f}" for size in sizes])
    ax.xaxis.set_minor_formatter(NullFormatter())
    ax.set(ylabel="time of one environment step [us]")
    ax.set_title("Time per step against batch size")


def _threads(ax: Axes, group: Group) -> None:
    most = 1
    for case, style in zip(
        dict.fromkeys(row.case for row in group.rows), ("o-", "s--"), strict=False
    ):
        shares = scaling.scaling(group, case)
        rates = [n * share for n, share in shares.items()]
        ax.plot(list(shares), rates, style, color=BLUE, label=case.partition(", ")[2])
        most = max(most, *shares)
    counts = range(1, most + 1)
    ax.plot(counts, counts, ":", color=GREY, label="ideal")
    ax.set(xlabel="threads", ylabel="rate [ratio to one thread]")
    ax.set_xticks(counts)
    ax.set(xlim=(0.0, most + 0.5), ylim=(0.0, most + 0.5))
    ax.legend(frameon=False)
    ax.set_title("Threads of one batch")


def _freedom(ax: Axes, group: Group) -> None:
    cases = ((scaling.EVALUATION, "o-", BLUE), (scaling.STEP_OF, "s-", ORANGE))
    for case, style, colour in cases:
        rows = sorted(group.of(case), key=lambda row: row.size or 0.0)
        times = [_MICRO * (row.time or np.nan) for row in rows]
        ax.plot([row.size or np.nan for row in rows], times, style, color=colour, label=case)
    ax.set(ylim=(0.0, None), xlabel="coordinates, other joints locked", ylabel="time [us]")
    ax.legend(frameon=False)
    ax.set_title("Degrees of freedom")


def _errors(ax: Axes, group: Group, scene: str) -> None:
    """Draw the time of a step against its error for every method."""
    settings = equal_steps.settings(group, equal_steps.case_of(scene))
    for method, colour, style in (
        (equal_steps.STEPPED, METHODS["moreau"], "o-"),
        (equal_steps.DOP853, METHODS["dop853"], "D-"),
        (equal_steps.DOPRI5, METHODS["dopri5"], "v-"),
        (equal_steps.ROSENBROCK, METHODS["rosenbrock"], "P-"),
        (equal_steps.BALANCED, BLACK, "*"),
        (equal_steps.EULER, VERMILION, "s-"),
        (equal_steps.RK4, GREY, "^-"),
    ):
        at = sorted((point.error, _MICRO * point.cost) for point in settings.get(method, []))
        if at:
            ax.plot(*zip(*at, strict=True), style, color=colour, label=method)
    for row in group.of(equal_steps.case_of(scene)):
        if row.label in equal_steps.USUAL and row.error is not None:
            said, time = row.label.rpartition(", ")[2], _MICRO * (row.time or np.nan)
            place = (row.error.median, time)
            ax.annotate(said, place, (4, -12), textcoords="offset points", fontsize=8)
    ax.set(xscale="log", yscale="log", ylabel="time of one environment step [us]")
    ax.set_xlabel(f"median error after {equal_steps.DURATION:g} s [rad], smaller to the right")
    ax.invert_xaxis()
    ax.margins(0.08)
    ax.legend(frameon=False, fontsize=8)
    ax.set_title(f"Cost against error, {name_of(scene)}")
