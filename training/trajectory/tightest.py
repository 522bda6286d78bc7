"""How far each limit of the step can be tightened: ``python -m training.trajectory.tightest``.

Each limit is tightened alone, little by little; a solution is the guess of the next. A series ends
where IPOPT finds no step in 80 iterations (160 for two values). This does not prove that there is
none. The barrier keeps its parameter, which leaves a margin to all limits and takes fewer
iterations.
"""

import argparse
import json
from collections.abc import Callable
from dataclasses import asdict, dataclass, replace
from pathlib import Path

import numpy as np
from joblib import Parallel, delayed
from matplotlib.figure import Figure

from skate_env.common import prepare_folder, progress_bar, write_figure, write_text

from .limits import Limits
from .problem import solve
from .solution import Solution, load

BODY_WEIGHT = 627.84
# Iterations for each value, parameter of the barrier, and the violation of a step that is found.
_ITERATIONS, _BARRIER, _FOUND = 80, 1e-3, 1e-4


@dataclass(frozen=True)
class Series:
    """Values of one limit.

    Attributes
    ----------
    title
        With its unit.
    values
        From loose to strict.
    problem
        (limits, guess, value) to the limits and the guess with this value.
    slow
        Values with twice as many iterations.
    """

    title: str
    values: tuple[float, ...]
    problem: Callable[[Limits, Solution, float], tuple[Limits, Solution]]
    slow: tuple[float, ...] = ()


def _total(limits: Limits, guess: Solution, value: float) -> tuple[Limits, Solution]:
    return replace(limits, total=value), guess


def _lift(limits: Limits, guess: Solution, value: float) -> tuple[Limits, Solution]:
    return replace(limits, lift=value * BODY_WEIGHT), guess


def _residual(limits: Limits, guess: Solution, value: float) -> tuple[Limits, Solution]:
    return replace(limits, residual=value, ankle=min(value, limits.ankle)), guess


def _air(limits: Limits, guess: Solution, value: float) -> tuple[Limits, Solution]:
    return replace(limits, air=value), guess


def _sole(limits: Limits, guess: Solution, value: float) -> tuple[Limits, Solution]:
    toe, heel, height = guess.foot
    part = value / (toe + heel)
    return limits, replace(guess, foot=(part * toe, part * heel, height))


def _feedforward(limits: Limits, guess: Solution, value: float) -> tuple[Limits, Solution]:
    return limits, replace(guess, scale=value)


SERIES = {
    "total": Series("largest torque of a joint [N m]", (345, 300, 260, 220, 180), _total),
    "lift": Series("largest lift [body weights]", (0.9875, 0.75, 0.5, 0.25, 0.0), _lift),
    "residual": Series("largest residual torque [N m]", (140, 130, 120, 110, 100), _residual),
    "air": Series("free foot in the air, part of the step", (0.507, 0.515, 0.525, 0.54), _air),
    "sole": Series("sole [m]", (0.24, 0.21), _sole),
    "feedforward": Series(
        "published torques, factor", (0.2, 0.3, 0.45, 0.65, 0.8, 1.0), _feedforward, (0.8, 1.0)
    ),
}
"""The first value of each series is that of `Limits` and the step."""


@dataclass(frozen=True)
class Point:
    """A step with one limit changed.

    Attributes
    ----------
    value
        The limit.
    status
        Of IPOPT.
    violation
        Largest violation of a constraint.
    effort
        See `Solution.effort`.
    duration
        Of the step [s].
    """

    value: float
    status: str
    violation: float
    effort: float
    duration: float

    @property
    def found(self) -> bool:
        """Whether it is a step."""
        return self.violation < _FOUND


def solved(value: float, limits: Limits, guess: Solution, more: int = 1) -> tuple[Point, Solution]:
    """Solve from a guess in ``more`` times the usual iterations; ``value`` is only noted."""
    iterations = more * _ITERATIONS
    limits = replace(limits, iterations=iterations, barrier=_BARRIER, target=_BARRIER)
    step, status, violation = solve(limits, guess)
    return Point(value, status, violation, step.effort, float(step.cuts[-1])), step


def tighten(name: str, first: Point, step: Solution, folder: Path) -> list[Point]:
    """Return the points of a series, whose last may not be found; save the steps of the others."""
    series = SERIES[name]
    made = [replace(first, value=series.values[0])]
    for value in series.values[1:]:
        limits, guess = series.problem(Limits(), step, value)
        new, step = solved(value, limits, guess, 2 if value in series.slow else 1)
        made.append(new)
        if not new.found:
            break
        step.save(folder / f"{name}_{value:g}.npz")
    return made


def draw(found: dict[str, list[Point]]) -> Figure:
    """Draw the effort over each limit; a dashed line marks a value without a step."""
    figure = Figure(figsize=(10.0, 6.0), layout="constrained")
    panels = figure.subplots(2, 3, sharey=True).ravel()
    for ax, (name, points) in zip(panels, found.items(), strict=False):
        steps = [point for point in points if point.found]
        ax.plot([p.value for p in steps], [p.effort for p in steps], "o-", color="#0072B2")
        for point in points[len(steps) :]:
            ax.axvline(point.value, color="#D55E00", linestyle="--", label="no step found")
            ax.legend(fontsize=8)
        first, last = SERIES[name].values[0], points[-1].value
        margin = 0.06 * (last - first)
        ax.set_xlim(first - margin, last + margin)
        ax.set_xlabel(SERIES[name].title)
        ax.set_ylim(0.0, 1.1 * max(p.effort for row in found.values() for p in row if p.found))
    figure.supylabel("residual torque, root mean square [N m]")
    return figure


def main() -> None:
    """Tighten each limit and draw what it costs."""
    parser = argparse.ArgumentParser(
        prog="python -m training.trajectory.tightest", description=(__doc__ or "").splitlines()[0]
    )
    parser.add_argument(
        "--step",
        type=Path,
        default=Path("out/trajectory/step.npz"),
        help="step to start from, of python -m training.trajectory",
    )
    parser.add_argument("--out", type=Path, default=Path("out/tightest"), help="folder")
    parser.add_argument("--workers", type=int, default=1, help="processes")
    parser.add_argument("--only", choices=SERIES, action="append", help="limit; repeatable")
    args = parser.parse_args()
    try:
        step = load(args.step)
    except (KeyError, OSError, ValueError) as error:
        parser.error(f"{args.step}: {error}")
    if args.workers < 1:
        parser.error(f"--workers {args.workers}: must be 1 or more")
    prepare_folder(args.out)
    names = args.only or list(SERIES)
    found = {}
    with progress_bar(1 + len(names), "limits", "limit") as bar:
        first, step = solved(np.nan, Limits(), step)
        bar.update()
        calls = (delayed(tighten)(name, first, step, args.out) for name in names)
        results = Parallel(n_jobs=args.workers, return_as="generator")(calls)
        for name, points in zip(names, results, strict=True):
            found[name] = points
            bar.update()
            _write(found, args.out)
    for name, points in found.items():
        print(SERIES[name].title)
        for point in points:
            made = f"{point.effort:5.1f} N m" if point.found else "no step found"
            print(f"  {point.value:7.3f}  {made}  ({point.status}, {point.duration:.3f} s)")


def _write(found: dict[str, list[Point]], folder: Path) -> None:
    write_figure(folder / "tightest.png", draw(found), dpi=110)
    rows = {name: [asdict(point) for point in points] for name, points in found.items()}
    write_text(folder / "tightest.json", json.dumps(rows, indent=1) + "\n")


if __name__ == "__main__":
    main()
