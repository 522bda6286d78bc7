"""How a gait depends on the parameters of its scene: ``python -m training.sensitivity``.

A gait is described by its last step, from one swap of the legs to the next: its slide, its period,
and the height of the head at its end. The motion is differentiated in parts that end shortly before
and after each event, so that positions and times at the events have their derivatives.
"""

import copy
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Annotated, Any

import numpy as np
import typer
from numpy.typing import NDArray

from skate_env import Scene, load_scene
from skate_env._core import Simulator
from skate_env.cli import options
from skate_env.cli.options import JsonOption, SceneOption
from skate_env.scenes import replace

Array = NDArray[np.float64]

QUANTITIES = {"slide": "m", "period": "s", "head height": "m"}
"""Quantities of a step with their units."""

# Distance of the ends of the parts from an event [s].
_BESIDE = 1e-9
# Parameters that select the start, the steps or the samples.
_NOT_DIFFERENTIABLE = ("start.", "accuracy", "control.sample_period", "control.action_period")
# Step of the derivative of the head's height at constant joint angles; its error is about 1e-12.
_GEOMETRY_STEP = 1e-3
# Row of the head in `Simulator.link_segments`.
_HEAD = -1
# Time at which a motion that does not make its steps is given up [s].
_LONGEST = 60.0


@dataclass(frozen=True)
class Sensitivity:
    """Derivatives of K quantities by M parameters that are not zero.

    Attributes
    ----------
    scene
        Of the gait.
    steps
        Number of steps from the start; the last one is described.
    parameters
        Names (M,) and values.
    values
        Quantities of the step (K,) [m, s].
    derivatives
        (K, M), per unit of the parameter.
    nonsmooth
        Reason, time [s] and margin where the derivative may not exist.
    """

    scene: Scene
    steps: int
    parameters: dict[str, float]
    values: Array
    derivatives: Array
    nonsmooth: Sequence[tuple[str, float, float]]

    @property
    def relative(self) -> Array:
        """Relative change of the quantities per relative change of the parameters (K, M)."""
        scaled: Array = self.derivatives * [*self.parameters.values()] / self.values[:, None]
        return scaled

    def ranked(self) -> dict[str, list[float]]:
        """Return the relative changes by parameter, the largest effect on any quantity first."""
        columns = zip(self.parameters, self.relative.T.tolist(), strict=True)
        return dict(sorted(columns, key=lambda each: -max(abs(x) for x in each[1])))


@dataclass(frozen=True)
class Gait:
    """A motion to the end of a step: its quantities (K,), and its events.

    Attributes
    ----------
    sequence
        Events without their times; each with the number of the controller's sample before it.
    swaps
        Times at which the step begins and ends [s].
    """

    values: Array
    times: list[float]
    sequence: list[tuple[str, int, int, str, int]]
    swaps: tuple[float, float]


def parameters(scene: Scene) -> dict[str, float]:
    """Values of the parameters by which a motion is differentiated: all that are not zero."""
    return {
        name: value
        for name, (value, *_) in scene.parameters().items()
        if value != 0.0 and not name.startswith(_NOT_DIFFERENTIABLE)
    }


def measure(scene: Scene, steps: int) -> Sensitivity:
    """Differentiate the step number ``steps``.

    Raises
    ------
    ValueError
        If the motion ends before, or if the scene's accuracy has no derivatives or does not locate
        events to 1 ns.
    """
    sim = Simulator(scene)
    names = parameters(scene)
    gait = walk(sim, steps)
    if gait is None:
        raise ValueError(f"scene {scene.name}: the motion ends before step {steps} is complete")
    nonsmooth = sim.linearize(until=gait.swaps[1] + _BESIDE).nonsmooth
    derivatives = _derivatives(sim, gait, list(names))
    return Sensitivity(scene, steps, names, gait.values, derivatives, nonsmooth)


def walk(sim: Simulator, steps: int) -> Gait | None:
    """Simulate a copy to the end of a step; None if the motion ends before."""
    walker, done, before = copy.copy(sim), list[dict[str, float]](), b""
    walker.take_steps()
    walker.take_events()
    while len(done) < steps:
        before = walker.snapshot()
        if walker.time > _LONGEST or not walker.step():
            return None
        done += walker.take_steps()
    begin, end = done[steps - 2]["time"], done[steps - 1]["time"]
    # The start itself may be an event, at a fixed time.
    events = [event for event in walker.take_events() if sim.time < event[0] <= end]
    walker.restore(before)
    walker.advance(end)
    values = [done[steps - 1]["slide"], end - begin, walker.head_position[2]]
    times = [event[0] for event in events]
    # A motion in which an event moves over a sample of the controller is another one, too.
    period = sim.scene.parameters()["control.sample_period"][0]
    sequence = [(*event[1:], int(event[0] // period)) for event in events]
    return Gait(np.array(values), times, sequence, (begin, end))


def _derivatives(sim: Simulator, gait: Gait, names: list[str]) -> Array:
    """Differentiate the quantities (K, M)."""
    walker = copy.copy(sim)
    begin, end = gait.swaps
    by = np.zeros((len(walker.state_vector()), len(names)))
    time = np.zeros(len(names))
    swap, slide = np.zeros(len(names)), np.zeros(len(names))

    def advance(until: float) -> list[Array]:
        """Carry ``by`` on; return the derivatives of the times of the events passed."""
        nonlocal by
        lin = walker.linearize(until=until, params=names)
        times = [event["dt_dx"] @ by + event["dt_dp"] for event in lin.events]
        by = lin.A @ by + lin.P
        walker.advance(until)
        return times

    n = len(walker.q)
    for t in _distinct(gait.times):
        advance(t - _BESIDE)
        before, velocity = by[0].copy(), walker.v[0]
        sliding = _slides(walker)
        passed = advance(t + _BESIDE)
        if not passed:
            raise ValueError(
                f"the event at {t:.9f} s moves by more than {_BESIDE:g} s where the motion is "
                "divided: choose the accuracy reference, or a tolerance of 1e-10 or less"
            )
        time = passed[0]
        if sliding and begin < t <= end:
            slide += before + velocity * time
        if t == begin:
            swap = time
        if _slides(walker) and begin <= t < end:
            slide -= by[0] + walker.v[0] * time
    head = by[:n] + walker.v[:, None] * time
    return np.stack([slide, time - swap, _head(walker, head, names)])


def _distinct(times: list[float]) -> list[float]:
    """Leave out times of events that the ends of the parts do not separate."""
    distinct = times[:1]
    for t in times[1:]:
        if t - distinct[-1] > 3.0 * _BESIDE:
            distinct.append(t)
    return distinct


def _slides(sim: Simulator) -> bool:
    """Whether the supporting foot slides: a column of Table 2, or both feet are in the air."""
    return sim.state_number == 0 or (sim.state_number - 1) % 4 >= 2


def _head(sim: Simulator, by: Array, names: list[str]) -> Array:
    """Differentiate the head's height (M,); ``by`` is the derivative of the coordinates (n, M)."""
    q = sim.q

    def height(robot: Simulator, q: Array) -> float:
        return float(robot.link_segments(q)[_HEAD, 1, 2])

    size = 1e-4 / max(1e-9, float(np.abs(by).max()))
    found = np.empty(len(names))
    start, robot = sim.scene.parameters(), Simulator(sim.scene)
    for column, name in enumerate(names):
        change = size * by[:, column]
        found[column] = (height(sim, q + change) - height(sim, q - change)) / (2.0 * size)
        value, least, most, _ = start[name]
        # The height is linear in lengths, so one side is enough at the end of a range.
        values = np.clip([value * (1.0 + sign * _GEOMETRY_STEP) for sign in (1, -1)], least, most)
        ends = []
        for changed in values:
            robot.reset(params={name: float(changed)})
            ends.append(height(robot, q))
        found[column] += np.diff(ends)[0] / np.diff(values)[0]
    return found


def summary(found: Sensitivity) -> dict[str, Any]:
    """Lay the result out for programs, the parameter with the largest effect first."""
    numbers = zip(QUANTITIES.items(), found.values.tolist(), strict=True)
    columns = dict(zip(found.parameters, found.derivatives.T.tolist(), strict=True))
    return {
        "scene": found.scene.name,
        "step": found.steps,
        "quantities": {name: {"value": x, "unit": unit} for (name, unit), x in numbers},
        "parameters": {
            name: {
                "value": found.parameters[name],
                "derivative": dict(zip(QUANTITIES, columns[name], strict=True)),
                "relative": dict(zip(QUANTITIES, relative, strict=True)),
            }
            for name, relative in found.ranked().items()
        },
        "nonsmooth": [list(reason) for reason in found.nonsmooth],
    }


def text(found: Sensitivity) -> str:
    """Lay the table out for a terminal."""
    numbers = zip(QUANTITIES.items(), found.values, strict=True)
    values = ", ".join(f"{name} {value:.5f} {unit}" for (name, unit), value in numbers)
    lines = [
        f"{found.scene.name}, step {found.steps}: {values}.",
        f"Reasons against the existence of the derivative: {len(found.nonsmooth)}.",
        "Relative change of a quantity per relative change of a parameter: at +2, one percent more",
        "of the parameter is two percent more of the quantity.",
        "",
        f"{'parameter':<40}{'value':>12}" + "".join(f"{name:>14}" for name in QUANTITIES),
    ]
    for name, relative in found.ranked().items():
        cells = "".join(f"{x:>+14.4f}" for x in relative)
        lines.append(f"{name:<40}{found.parameters[name]:>12.5g}{cells}")
    return "\n".join(lines)


app = typer.Typer(add_completion=False, pretty_exceptions_enable=False, rich_markup_mode=None)


@app.command()
def sensitivity(
    scene: SceneOption = "paper",
    steps: Annotated[
        int, typer.Option(min=2, max=100, help="Number of the step that is described.")
    ] = 2,
    accuracy: Annotated[
        str, typer.Option(help="reference, a tolerance of 1e-10 or less, or JSON.")
    ] = "reference",
    as_json: JsonOption = False,
) -> None:
    """Rank the parameters of a scene by their effect on its gait.

    The command differentiates slide and period of a step, and the height of the head at its end,
    by every parameter that is not zero: through all impacts, contact changes and swaps of the legs
    from the start to the end of that step. The table has relative changes with their sign. The
    start stays as it is.

    \b
    The second step of the paper's scene:
      python -m training.sensitivity
    Another step and scene, for programs:
      python -m training.sensitivity --scene paper_arms --steps 4 --json
    """  # noqa: D301 (\b keeps the examples' line breaks)
    try:
        found = measure(replace(load_scene(scene), {"accuracy": options.value(accuracy)}), steps)
    except (ValueError, OSError) as error:
        options.fail(error)
    options.show(text(found), None, summary(found) if as_json else None)


if __name__ == "__main__":
    app()
