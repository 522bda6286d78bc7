"""An independent reference: the same equations of motion, integrated by SciPy.

SciPy's solvers integrate the motion from event to event. The engine provides the right-hand side,
the guard functions and the reset maps. Errors propagate from one segment to the next, as in the
engine.
"""

from collections.abc import Iterator
from dataclasses import dataclass, field, replace
from importlib import import_module
from typing import Any

import numpy as np

from ..._core import Simulator
from ..motions.cases import Case
from .engine import begin, outcome
from .outcome import Array, Outcome
from .settings import TIGHTEST, dopri5

SOLVERS: dict[str, float] = {"DOP853": 1e-13, "Radau": 1e-10}
"""Solvers and their relative tolerances: an explicit one of order 8, an implicit one of order 5."""

# Longest step [s], and the relative increment of finite differences.
_LONGEST, _DIFFERENCE = 0.01, 1e-7
# Fractions of a step at which guards are evaluated.
_FRACTIONS = (0.25, 0.5, 0.75, 1.0)
# Bisection locates an event to `_BISECTED` [s]. At most `_SECANTS` secant steps refine it to
# `_INSTANT` [s], with the slope from two times `_NEAR` [s] apart.
_BISECTED, _NEAR, _INSTANT = 1e-10, 1e-7, 1e-14
_SECANTS = 8
# With two-way contact this guard triggers for both signs.
_EITHER_SIDE = "free toe lands"
# Force guards that start below zero by less than this share of the weight count as positive: their
# event is due if they decrease further.
_SLACK = 1e-6
_FORCES = ("lifts", "slips", "sign")


class Unavailable(Exception):
    """SciPy is not installed."""


def available() -> None:
    """Raise `Unavailable` where there is no SciPy."""
    try:
        import_module("scipy.integrate")
    except ImportError:
        raise Unavailable("scipy is not installed") from None


def run(case: Case, start: int, solver: str = "DOP853", tolerance: float | None = None) -> Outcome:
    """Compute a motion with one of SciPy's solvers.

    Raises
    ------
    Unavailable
        If SciPy is not installed.
    """
    available()
    sim = begin(case, case.with_accuracy(dopri5(TIGHTEST).accuracy), start)
    first, begun = sim.state_number, sim.q[0]
    sim.advance(0.0, case.torque)
    made = getattr(import_module("scipy.integrate"), solver)
    robot = _Robot(sim, made, tolerance or SOLVERS[solver])
    robot.go(case.duration)
    done = outcome(sim, first, begun, None)
    # The engine's energy balance and counters do not include this integration.
    stats = {"evaluations": float(robot.evaluations), "steps": float(robot.steps)}
    q, v = robot.split(robot.y)
    slide = float(q[0] - begun)
    return replace(done, time=robot.t, q=q, v=v, slide=slide, energy_residual=None, stats=stats)


@dataclass
class _Robot:
    """Integration of the motion between events."""

    sim: Simulator
    solver: Any
    tolerance: float
    t: float = 0.0
    evaluations: int = 0
    steps: int = 0
    y: Array = field(init=False)
    guard: dict[str, float] = field(init=False)
    """Guard values at the end of the last step."""

    def __post_init__(self) -> None:
        numbers = self.sim.scene.parameters()
        self._period = numbers["control.sample_period"][0]
        mass = sum(float(body["mass"]) for body in self.sim.bodies())
        gravity = numbers["ice.gravity"][0]
        self._slack = _SLACK * mass * gravity
        self._both = not self.sim.scene.effects()["push_only"]
        self._implicit = self.solver.__name__ == "Radau"
        self._read()

    def split(self, y: Array) -> tuple[Array, Array]:
        n = len(y) // 2
        return np.ascontiguousarray(y[:n]), np.ascontiguousarray(y[n:])

    def go(self, end: float) -> None:
        """Integrate to a time, or to the end of the motion."""
        while self.t < end and self.sim.termination is None:
            event, y = self._segment(end)
            self.y = y
            if event is not None:
                self.sim.reset_map(self.t, *self.split(y), event.guard)
                self._read()

    def _read(self) -> None:
        self.y = np.concatenate([self.sim.q, self.sim.v])
        self.guard = self._guards(self.t, self.y)
        for name, value in self.guard.items():
            if -self._slack < value <= 0.0 and any(word in name for word in _FORCES):
                self.guard[name] = np.finfo(float).tiny

    def _segment(self, end: float) -> "tuple[_Event | None, Array]":
        """Integrate to the next event, or to `end`."""
        solver = self._solver(self.t, self.y, end)
        while solver.status == "running":
            before = solver.y.copy()
            solver.step()
            self.steps += 1
            if solver.status == "failed":
                raise ArithmeticError(f"{self.solver.__name__} fails at {solver.t:.6g} s")
            event = self._first(solver.t_old, solver.t, solver.dense_output())
            if event is not None:
                return self._polished(event, solver.t_old, before)
            self.t = solver.t
            self.guard = self._guards(solver.t, solver.y)
        return None, solver.y

    def _first(self, t: float, end: float, path: Any) -> "_Event | None":
        """Find the earliest zero of a guard, or sample that changes the torques."""
        events = list(self._crossings(t, end, path))
        events += self._samples(t, min([end, *(event.time for event in events)]), path)
        return min(events, key=lambda event: event.time, default=None)

    def _crossings(self, t: float, end: float, path: Any) -> "Iterator[_Event]":
        start, last = self.guard, t
        for fraction in _FRACTIONS:
            at = t + fraction * (end - t)
            values = self._guards(at, path(at))
            for name, value in values.items():
                sign = -1.0 if self._either(name) and start[name] < 0.0 else 1.0
                if sign * start[name] > 0.0 >= sign * value:
                    yield _Event(self._root(name, sign, (last, at), path), name)
            start, last = values, at

    def _samples(self, t: float, end: float, path: Any) -> "list[_Event]":
        tick = int(np.floor(t / self._period * (1.0 + 1e-12))) + 1
        while (at := tick * self._period) <= end:
            if self.sim.sampled(at, *self.split(path(at))):
                return [_Event(at, None)]
            tick += 1
        return []

    def _root(self, name: str, sign: float, between: tuple[float, float], path: Any) -> float:
        """Locate the zero of a guard by bisection."""
        low, high = between
        while high - low > _BISECTED:
            middle = 0.5 * (low + high)
            if sign * self._guards(middle, path(middle))[name] > 0.0:
                low = middle
            else:
                high = middle
        return high

    def _polished(self, event: "_Event", t: float, y: Array) -> "tuple[_Event, Array]":
        """Integrate from the start of the step to the event, refined by the secant method."""
        self.t, there = event.time, self._carried(t, y, event.time)
        # The slope of a guard is nearly constant over so short a time.
        near = event.time - _NEAR
        if event.guard is None or near <= t:
            return event, there
        value = self._guards(self.t, there)[event.guard]
        slope = (value - self._guards(near, self._carried(t, y, near))[event.guard]) / _NEAR
        for _ in range(_SECANTS):
            change = -value / slope if slope != 0.0 else 0.0
            if not _INSTANT < abs(change) < _NEAR:
                break
            self.t += change
            there = self._carried(t, y, self.t)
            value = self._guards(self.t, there)[event.guard]
        return event, there

    def _carried(self, t: float, y: Array, end: float) -> Array:
        if end <= t:
            return y
        solver = self._solver(t, y, end, first_step=end - t)
        while solver.status == "running":
            solver.step()
        result: Array = solver.y
        return result

    def _solver(self, t: float, y: Array, end: float, **options: Any) -> Any:
        tolerances = {"rtol": self.tolerance, "atol": self.tolerance}
        jacobian: dict[str, Any] = {"jac": self._jacobian} if self._implicit else {}
        options |= tolerances | jacobian
        return self.solver(self._rates, t, y, end, max_step=_LONGEST, **options)

    def _rates(self, t: float, y: Array) -> Array:
        self.evaluations += 1
        q, v = self.split(y)
        try:
            return np.concatenate([v, self.sim.rhs(t, q, v)])
        except ValueError:
            # The trial step is too long; the solver rejects it.
            return np.full_like(y, np.nan)

    def _jacobian(self, t: float, y: Array) -> Array:
        """Use fixed increments; SciPy increases its own where a coordinate has no effect."""
        here, columns = self._rates(t, y), []
        for i in range(len(y)):
            moved = y.copy()
            moved[i] += _DIFFERENCE * max(1.0, abs(y[i]))
            columns.append((self._rates(t, moved) - here) / (moved[i] - y[i]))
        return np.array(columns).T

    def _guards(self, t: float, y: Array) -> dict[str, float]:
        return dict(self.sim.guards(t, *self.split(y)))

    def _either(self, name: str) -> bool:
        return self._both and name.startswith(_EITHER_SIDE)


@dataclass(frozen=True)
class _Event:
    time: float
    guard: str | None
    """None for a sample of the controller."""
