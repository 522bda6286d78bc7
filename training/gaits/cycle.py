"""The cycle of a gait in the limit of short sample periods, with its derivatives.

With samples of 1 ms an orbit lies on a small smooth piece: where an event passes a sample, torques
change by a millisecond. Here samples are so short that a motion is that of a controller without a
clock, whose period is free. `Simulator.linearize` holds the times of samples fixed. In the limit a
sample follows the event that changes the controller, so that

    dx+ = dx- + (f- - f+) dt_e

is added at each of them: f- and f+ are the rates before and after it, dt_e is the change of the
event's time. The orbit's own direction then has the multiplier 1.
"""

import math
from collections.abc import Sequence
from dataclasses import dataclass
from itertools import pairwise

import numpy as np
from numpy.typing import NDArray

from skate_env import Scene
from skate_env.scenes import replace

from ..orbits.strobe import SAMPLE_PERIOD, Strobe, unread

Array = NDArray[np.float64]

# Sample period, the shortest that a scene can have [s].
SHORT = 1e-5
# Distance from a sample at which rates are taken, and the rounding of its number [s, samples].
_BESIDE, _ROUNDING = 2e-9, 1e-7
# Places in state 3, from its middle [its duration]. Where the ice pulls without friction, a start
# may slide and press instead: there its rates differ by more than this part.
_PLACES, _SAME = (0.0, 0.25, -0.25, 0.4, -0.4), 1e-6
# Simulated time before a cycle is taken [s].
_SETTLE = 30.0
# Weight of angles in the size of a residual [1/s]; residual of a closed cycle [rad/s]: that of a
# sample that comes 10 us earlier or later.
_ANGLE, CLOSED = 10.0, 2e-2
_AIM, _ITERATIONS, _SHORTEST = 2e-3, 10, 0.02


@dataclass(frozen=True)
class Point:
    """A state of a cycle.

    Attributes
    ----------
    x
        Relative state, see `Strobe` (s,).
    leg
        Supporting leg.
    period
        Of the gait step that follows [s].
    """

    x: Array
    leg: str
    period: float


@dataclass(frozen=True)
class Linear:
    """Derivatives of a gait step.

    Attributes
    ----------
    P
        In the tangent space (d, d), mirrored back.
    basis
        Orthonormal (s, d).
    along
        Rate of the state at the start and at the mirrored end (s,).
    by_parameters
        Of the end (s, m).
    """

    P: Array
    basis: Array
    along: tuple[Array, Array]
    by_parameters: Array

    def solve(self, loads: Array) -> Array:
        """Return changes of the point (d + 1, k) that change what a step changes by ``loads``.

        The last row is that of the period. Changes along the orbit are left out.
        """
        start, end = (self.basis.T @ each for each in self.along)
        step = np.column_stack([self.P - np.eye(len(self.P)), end])
        matrix = np.vstack([step, np.append(start / np.linalg.norm(start), 0.0)])
        right = np.vstack([self.basis.T @ loads, np.zeros(loads.shape[1])])
        return np.asarray(np.linalg.lstsq(matrix, right)[0])


class Cycle:
    """Cycles of a scene; one gait step, mirrored, is a cycle.

    Parameters
    ----------
    scene
        Its accuracy and its sample period are replaced.
    """

    def __init__(self, scene: Scene) -> None:
        short = {"accuracy": "reference", SAMPLE_PERIOD: SHORT}
        self.strobe = Strobe(replace(scene, short))
        self.sim = self.strobe.sim

    def found(self) -> Point:
        """Return a point in the longest time in state 3 of a step from the scene's start.

        Raises
        ------
        ValueError
            If the motion ends before, a step has no state 3, or no start in it goes on like it.
        """
        sim = self.sim
        sim.reset()
        sim.advance(_SETTLE)
        sim.take_steps()
        while sim.advance(sim.time + sim.action_period):
            if swaps := sim.take_steps():
                break
        else:
            raise ValueError(f"the motion ends with {sim.termination} after {sim.time:.2f} s")
        begin, period, here = swaps[0]["time"], swaps[0]["period"], sim.snapshot()
        sim.take_events()
        state = sim.state_number
        sim.advance(begin + 0.9 * period)
        events = sim.take_events()
        states = [state, *(event[3] for event in events)]
        times = [begin, *(event[0] for event in events)]
        visits = zip(states, pairwise(times), strict=False)
        spans = [(b - a, 0.5 * (a + b)) for visited, (a, b) in visits if visited == 3]
        if not spans:
            raise ValueError("a step has no time in state 3")
        duration, middle = max(spans)
        for place in _PLACES:
            sim.restore(here)
            sim.advance(middle + place * duration)
            point = Point(self.strobe.state, sim.support_leg, period)
            rates = sim.rhs(sim.time, sim.q, sim.v)
            self.begin(point)
            changed = np.abs(sim.rhs(sim.time, sim.q, sim.v) - rates).max()
            if changed < _SAME * np.abs(rates).max():
                return point
        raise ValueError("no start in state 3 goes on like the motion")

    def begin(self, point: Point) -> Array:
        """Set the simulator to a point at time 0; return its state with the constraints met.

        Raises
        ------
        ValueError
            If it is no valid start.
        """
        self.strobe.set(point.x, point.leg)
        self.sim.take_events()
        self.sim.take_steps()
        return self.strobe.state

    def residual(self, point: Point) -> Array:
        """Return what a step changes (s,); infinite if it does not start or ends before."""
        try:
            before = self.begin(point)
            ended = not self.sim.advance(point.period)
        except ValueError:  # A start below the ice, or a negative period.
            ended = True
        if ended:
            return np.full(len(point.x), np.inf)
        change: Array = self.strobe.back(1) @ self.strobe.state - before
        return change

    def events(self, point: Point) -> list[str]:
        """Return the names of the events of a step, in sequence."""
        self.begin(point)
        self.sim.advance(point.period)
        return [event[1] for event in self.sim.take_events()]

    def size(self, residual: Array) -> float:
        """Return the largest entry of a residual [rad/s]; an angle counts tenfold."""
        n = self.strobe.n
        angles, rates = residual[1:n], residual[n : 2 * n]
        return float(max(_ANGLE * np.abs(angles).max(), np.abs(rates).max()))

    def linearize(self, point: Point, parameters: Sequence[str] = ()) -> Linear:
        """Differentiate the step from a point, also by parameters of the scene.

        Raises
        ------
        ValueError
            If the step ends before.
        """
        sim, strobe, names = self.sim, self.strobe, list(parameters)
        self.begin(point)
        tangent, first = sim.linearize().tangent_before, self._along()
        A, by = np.eye(len(point.x)), np.zeros((len(point.x), len(names)))
        for end in self._ends(point.period):
            lin = sim.linearize(until=end, params=names)
            a, p = lin.A, lin.P
            # The sample's new torques may change the sign of a force at once, another event.
            followed = [event for event in lin.events if event["time"] < end - _BESIDE]
            if followed and end < point.period:
                jump, event = self._jump(end), followed[-1]
                a = a + np.outer(jump, event["dt_dx"])
                p = p + np.outer(jump, event["dt_dp"])
            A, by = a @ A, a @ by + p
            sim.advance(end)
        back = strobe.back(1)
        A, by = back @ strobe.reduction @ A, back @ strobe.reduction @ by
        basis = strobe.basis(tangent, unread(A, 2 * strobe.n))
        return Linear(basis.T @ A @ basis, basis, (first, back @ self._along()), by)

    def close(self, point: Point) -> tuple[Point, Linear, float]:
        """Close the cycle near a point by Newton's method; also return the residual's size.

        Raises
        ------
        ValueError
            If the cycle does not close.
        """
        residual = self.residual(point)
        size = self.size(residual)
        if not math.isfinite(size):
            raise ValueError("the motion ends within a step")
        here = self.linearize(point)
        for _ in range(_ITERATIONS):
            if size < _AIM:
                break
            change = here.solve(-residual[:, None])[:, 0]
            part = 1.0
            while part > _SHORTEST:
                new = moved(point, part * (here.basis @ change[:-1]), part * float(change[-1]))
                changed = self.residual(new)
                if self.size(changed) < (1.0 - 0.1 * part) * size:
                    break
                part *= 0.5
            else:
                break
            point, residual, size = new, changed, self.size(changed)
            here = self.linearize(point)
        if size > CLOSED:
            raise ValueError(f"open by {size:.1e} rad/s")
        return point, here, size

    def _ends(self, period: float) -> list[float]:
        """Return the samples that follow an event in a step, and the end of the step."""
        here = self.sim.snapshot()
        self.sim.advance(period)
        events = self.sim.take_events()
        self.sim.restore(here)
        ticks = {math.ceil(event[0] / SHORT - _ROUNDING) for event in events}
        inside = [tick * SHORT for tick in sorted(ticks) if 2.0 * _BESIDE < tick * SHORT < period]
        return [*inside, period]

    def _jump(self, sample: float) -> Array:
        """Return (f- - f+) at a sample (s,)."""
        sim, n, here = self.sim, self.strobe.n, self.sim.snapshot()
        sides = []
        for time in (sample - _BESIDE, sample + _BESIDE):
            sim.advance(time)
            sides.append((sim.rhs(time, sim.q, sim.v), sim.state_vector()[2 * n + 1 :]))
        sim.restore(here)
        jump = np.zeros(2 * n + 4)
        jump[n : 2 * n] = sides[0][0] - sides[1][0]
        # A time that the sample sets to the present.
        jump[2 * n + 1 :] = sides[0][1] != sides[1][1]
        return jump

    def _along(self) -> Array:
        sim = self.sim
        rate = np.concatenate([sim.v, sim.rhs(sim.time, sim.q, sim.v), [-sim.v[0]], [-1.0] * 3])
        rate[0] = 0.0
        return rate


def moved(point: Point, dx: Array, period: float) -> Point:
    """Return a point with ``dx`` and ``period`` added."""
    return Point(point.x + dx, point.leg, point.period + period)
