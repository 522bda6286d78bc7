"""Orbits are found by simulation and closed by Newton's method."""

import math
from collections.abc import Iterator, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from skate_env import Scene

from .strobe import Derivative, Start, Strobe

Array = NDArray[np.float64]

# Largest residual of a closed orbit, in SI units.
CLOSED = 1e-9
# Newton's method goes on to here while it converges.
_AIM = 3e-11
_ITERATIONS = 12
# Least part of a Newton step; one that needs less leaves the smooth piece of the map.
_SHORTEST = 0.1
# Simulated time between two attempts, with short cycles tried, and in all [s].
_CHUNK, _SEARCHED, _LONGEST = 40.0, 80.0, 900.0
# Longest cycle [gait steps] that is recognised, and the difference at which it is.
_MOST_STEPS, _LOCKED = 120, 1e-6
# Time without a swap after which a motion is given up [s].
_STANDS = 5.0
# Gait steps from the start that are no candidates.
_TRANSIENT = 10
# Number of candidates for cycles of one and of two gait steps, and their largest miss.
_CANDIDATES, _NEAR = {1: 24, 2: 2}, 0.2
# Delay of the start of a longer cycle [s]. Rounding makes its residual 1e-9 to 1e-8 rad/s right
# after a swap, where rates change fast, and 1e-10 from here on; Newton's method does not reduce it.
_DELAY = 0.02
# Scale of the samples' period in Newton's method, and its step in differences [s].
_PERIOD_SCALE, _PERIOD_STEP = 1e-7, 3e-9
# Largest relative change of the samples' period in a step of Newton's method.
_PERIOD_CHANGE = 1e-3


@dataclass(frozen=True)
class Orbit:
    """A closed orbit.

    Attributes
    ----------
    strobe
        Map of the scene.
    start
        State on the orbit, at the first sample after a swap of the legs.
    residual
        What a cycle changes (s,).
    derivative
        Of a cycle from the start.
    settled
        Time from the scene's start to the candidate [s].
    """

    strobe: Strobe
    start: Start
    residual: Array
    derivative: Derivative
    settled: float

    @property
    def tuned(self) -> bool:
        """Whether the period of the samples differs from the scene's."""
        return bool(self.start.period != self.strobe.period)

    @property
    def size(self) -> float:
        """Largest entry of the residual, in SI units."""
        return float(np.abs(self.residual[self.derivative.kept]).max())


@dataclass(frozen=True)
class Section:
    """State at the first sample after a swap."""

    tick: int
    snapshot: bytes
    state: Array


def find(scene: Scene) -> Orbit:
    """Find an orbit of a scene from its start, and close it.

    The motion is simulated, and Newton's method starts where a cycle of one or two gait steps comes
    nearest to itself; then there with samples whose period is free. If neither closes, the motion
    goes on until it repeats.

    Raises
    ------
    ValueError
        If the motion ends, or no orbit is found.
    """
    strobe = Strobe(scene)
    strobe.sim.linearize()
    found: list[Section] = []
    tried: set[tuple[int, int]] = set()
    until = 0.0
    while until < _LONGEST:
        until += _CHUNK
        found = _simulate(strobe, found, until)
        for start, free in _candidates(strobe, found, until):
            if free or (start.tick, start.samples) not in tried:
                tried.add((start.tick, start.samples))
                orbit = newton(strobe, start, free=free)
                if orbit is not None:
                    return orbit
    raise ValueError(f"scene {scene.name}: no orbit found in {until:g} s")


def _candidates(strobe: Strobe, walk: Sequence[Section], until: float) -> list[tuple[Start, bool]]:
    """Return starts for Newton's method, and whether the samples' period is free."""
    found = [(start, False) for start in _repetitions(strobe, walk)]
    if until <= _SEARCHED:
        for steps in _CANDIDATES:
            found += [(start, False) for start in _recurrences(strobe, walk, steps)]
    if until == _CHUNK:
        found += [(start, True) for start in _recurrences(strobe, walk, 1)]
    return found


def newton(strobe: Strobe, start: Start, *, free: bool = False) -> Orbit | None:
    """Close an orbit near a start; None if Newton's method does not converge.

    Parameters
    ----------
    strobe
        Map of the scene.
    start
        Near the orbit.
    free
        Whether the samples' period is unknown, too. There is then a solution for every delay from
        the swap to the sample; the nearest is taken.
    """
    settled, long = start.tick * start.period, start.steps > max(_CANDIDATES)
    aim = CLOSED if long else _AIM
    try:
        if long:
            start = strobe.later(start, round(_DELAY / start.period))
        residual = strobe.residual(start)
        if free:
            before, start = residual, strobe.rebuilt(start, start.period)
            residual = strobe.residual(start)
            if np.abs(residual - before).max() > _LOCKED:
                return None
        # A derivative of a long cycle takes as long as ten cycles.
        if long and np.abs(residual[: 2 * strobe.n]).max() > CLOSED:
            return None
        for _ in range(_ITERATIONS):
            here = strobe.derivative(start)
            if np.abs(residual[here.kept]).max() < aim:
                break
            better = _improved(strobe, start, (residual, here), free)
            if better is None:
                break
            start, residual = better
    except ValueError:  # A state that a reset refuses, or a cycle that ends in a fall.
        return None
    orbit = Orbit(strobe, start, residual, here, settled)
    return orbit if orbit.size < CLOSED else None


def _improved(
    strobe: Strobe, start: Start, now: tuple[Array, Derivative], free: bool
) -> tuple[Start, Array] | None:
    """Make one damped Newton step; None if no part of it reduces the residual."""
    residual, here = now
    d, size = len(here.P), np.abs(residual[here.kept]).max()
    J = here.P - np.eye(d)
    if free:
        J = np.column_stack([J, here.basis.T @ _by_period(strobe, start) * _PERIOD_SCALE])
    found = np.linalg.lstsq(J, -here.basis.T @ residual)[0]
    if free and abs(found[d]) * _PERIOD_SCALE > _PERIOD_CHANGE * start.period:
        return None
    part = 1.0
    while part > _SHORTEST:
        new = strobe.displaced(start, part * (here.basis @ found[:d]))
        if free:
            new = strobe.rebuilt(new, start.period + part * _PERIOD_SCALE * float(found[d]))
        changed = strobe.residual(new)
        if np.abs(changed[here.kept]).max() < (1.0 - 0.1 * part) * size:
            return new, changed
        part *= 0.5
    return None


def _by_period(strobe: Strobe, start: Start) -> Array:
    """Differentiate the end of a cycle by the samples' period (s,), by central differences."""
    ends = []
    for sign in (1.0, -1.0):
        ends.append(strobe.end(strobe.rebuilt(start, start.period + sign * _PERIOD_STEP)))
    by: Array = (ends[0] - ends[1]) / (2.0 * _PERIOD_STEP)
    return by


def sections(strobe: Strobe, period: float) -> Iterator[Section]:
    """Continue the simulator's motion, and yield its sections until it falls or stands still.

    ``period`` is that of the samples [s].
    """
    sim = strobe.sim
    sim.take_steps()
    last = sim.time
    while sim.time - last < _STANDS:
        before = sim.snapshot()
        if not sim.advance(sim.time + sim.action_period):
            return
        swaps = sim.take_steps()
        if swaps:
            tick = math.ceil(swaps[0]["time"] / period - 1e-6)
            sim.restore(before)
            sim.advance(tick * period)
            section = Section(tick, sim.snapshot(), strobe.state)
            yield section
            sim.restore(section.snapshot)
            sim.take_steps()
            last = sim.time


def _simulate(strobe: Strobe, begun: Sequence[Section], until: float) -> list[Section]:
    """Continue the sections to a time [s].

    Raises
    ------
    ValueError
        If the motion ends before.
    """
    made = list(begun)
    if made:
        strobe.sim.restore(made[-1].snapshot)
    else:
        strobe.sim.reset()
    for section in sections(strobe, strobe.period):
        made.append(section)
        if section.tick * strobe.period > until:
            return made
    sim = strobe.sim
    raise ValueError(
        f"scene {strobe.scene.name}: no orbit: {sim.termination or 'no swap'} after "
        f"{sim.time:.2f} s and {len(made)} gait steps"
    )


def _start(strobe: Strobe, walk: Sequence[Section], first: int, steps: int) -> Start:
    samples = walk[first + steps].tick - walk[first].tick
    return Start(walk[first].snapshot, walk[first].tick, strobe.period, steps, samples)


def _recurrences(strobe: Strobe, walk: Sequence[Section], steps: int) -> list[Start]:
    """Return the starts of the cycles that come nearest to themselves, nearest first."""
    moving = slice(0, 2 * strobe.n)
    states = np.array([section.state[moving] for section in walk[_TRANSIENT:]])
    back = strobe.back(steps)[moving, moving]
    misses = np.abs(states[steps:] @ back.T - states[:-steps]).max(axis=1)
    nearest = np.argsort(misses, kind="stable")[: _CANDIDATES[steps]]
    near = nearest[misses[nearest] < _NEAR]
    return [_start(strobe, walk, _TRANSIENT + int(i), steps) for i in near]


def _repetitions(strobe: Strobe, walk: Sequence[Section]) -> list[Start]:
    """Return the start of the shortest cycle that the motion repeats, where it repeats best."""
    moving = slice(0, 2 * strobe.n)
    states = np.array([section.state[moving] for section in walk])
    for steps in range(1, min(_MOST_STEPS, len(walk) - 1) + 1):
        back = strobe.back(steps)[moving, moving]
        misses = np.abs(states[steps:] @ back.T - states[:-steps]).max(axis=1)
        if misses[-1] < _LOCKED:
            return [_start(strobe, walk, int(misses.argmin()), steps)]
    return []
