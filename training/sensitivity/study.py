"""Derivatives of a gait by the parameters of its scene, and the same by differences.

A gait is described by its last step, from one swap of the legs to the next: its slide, its period,
and the height of the head at its end. The motion is differentiated in parts that end shortly before
and after each event, so that positions and times at the events have their derivatives.
"""

import copy
from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from skate_env._core import Scene, Simulator

Array = NDArray[np.float64]

QUANTITIES = {"slide": "m", "period": "s", "head height": "m"}
"""Quantities of a step with their units."""

# Distance of the ends of the parts from an event [s].
_BESIDE = 1e-9
# Parameters that select the start, the steps or the samples.
_NOT_DIFFERENTIABLE = ("start.", "accuracy", "control.sample_period", "control.action_period")
# Steps of the differences, relative to the parameter, largest first.
_STEPS = [2e-4 * 8.0**-k for k in range(4)]
# Error of a quantity by rounding and by the tolerance, which the differences divide by the step.
_NOISE = 1e-12
# Step of the derivative of the head's height at constant joint angles; its error is about 1e-12.
_GEOMETRY_STEP = 1e-3
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
    differences
        The same by central differences of the motion; NaN where every change of the parameter
        changes the sequence of events or leaves its range.
    nonsmooth
        Reason, time [s] and margin where the derivative may not exist.
    """

    scene: Scene
    steps: int
    parameters: dict[str, float]
    values: Array
    derivatives: Array
    differences: Array
    nonsmooth: Sequence[tuple[str, float, float]]

    @property
    def relative(self) -> Array:
        """Relative change of the quantities per relative change of the parameters (K, M)."""
        return self._scaled(self.derivatives)

    @property
    def errors(self) -> Array:
        """Deviation of `relative` from that by differences (K, M)."""
        return np.abs(self._scaled(self.derivatives - self.differences))

    def _scaled(self, derivatives: Array) -> Array:
        scaled: Array = derivatives * [*self.parameters.values()] / self.values[:, None]
        return scaled


@dataclass(frozen=True)
class _Gait:
    """A motion to the end of a step: its quantities (K,), and its events."""

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


def measure(scene: Scene, steps: int, progress: Callable[[int], object]) -> Sensitivity:
    """Differentiate the step number ``steps``; ``progress`` counts the parameters.

    Raises
    ------
    ValueError
        If the motion ends before, or if the scene's accuracy has no derivatives or does not locate
        events to 1 ns.
    """
    sim = Simulator(scene)
    names = parameters(scene)
    gait = _walk(sim, steps)
    if gait is None:
        raise ValueError(f"scene {scene.name}: the motion ends before step {steps} is complete")
    nonsmooth = sim.linearize(until=gait.swaps[1] + _BESIDE).nonsmooth
    derivatives = _derivatives(sim, gait, list(names))
    differences = np.full_like(derivatives, np.nan)
    for column, (name, value) in enumerate(names.items()):
        differences[:, column] = _difference(scene, steps, (name, value), gait)
        progress(1)
    return Sensitivity(scene, steps, names, gait.values, derivatives, differences, nonsmooth)


def _walk(sim: Simulator, steps: int) -> _Gait | None:
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
    return _Gait(np.array(values), times, sequence, (begin, end))


def _derivatives(sim: Simulator, gait: _Gait, names: list[str]) -> Array:
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


# Row of the head in `Simulator.link_segments`.
_HEAD = -1


def _difference(scene: Scene, steps: int, parameter: tuple[str, float], gait: _Gait) -> Array:
    """Central difference of order 4 (K,) with the step whose error is smallest."""
    name, value = parameter
    best, least = np.full(len(QUANTITIES), np.nan), np.inf
    sim = Simulator(scene)
    for relative in _STEPS:
        step = relative * abs(value)
        if _NOISE / step > least:
            break
        ends = []
        for k in (-2, -1, 1, 2):
            try:
                sim.reset(params={name: value + k * step})
            except ValueError:  # Outside the parameter's range.
                break
            changed = _walk(sim, steps)
            if changed is None or changed.sequence != gait.sequence:
                break
            ends.append(changed.values)
        else:
            near, far = ends[2] - ends[1], ends[3] - ends[0]
            found = (8.0 * near - far) / (12.0 * step)
            # Above the truncation of order 4; it also shows a kink between the points.
            error = np.abs(found - near / (2.0 * step)).max() + _NOISE / step
            if error < least:
                best, least = found, error
    return best
