"""What is measured on a closed orbit: decay, margins, states, and the perturbations that return."""

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace
from itertools import islice

import numpy as np
from numpy.typing import NDArray

from .close import Orbit, sections
from .strobe import Start

Array = NDArray[np.float64]

# Gait steps over which the decay is compared.
STEPS = 10
# Cycles before, in which fast directions decay.
_FADE = 3
# Deviation at the start, and the largest on the way, in SI units.
_SMALL, _LARGEST = 1e-4, 3e-4
# Guards nearer than this to an event are no margins: they start or end at zero [s].
_APART = 2e-3
# Contact states of less than this are left out of the order [s].
_VISIT = 2e-3
# Random directions in which perturbations are bisected.
DIRECTIONS = 3
# Search of the largest perturbation that returns: least number of gait steps, sizes [rad, rad/s],
# bisections, and the part of the perturbation below which the motion has returned.
_RETURN_STEPS, _LARGEST_NOISE, _LEAST_NOISE, _HALVINGS, _RETURNED = 80, 0.32, 1e-5, 2, 0.1


@dataclass(frozen=True)
class Decay:
    """Deviations from the orbit after each gait step.

    Attributes
    ----------
    measured, predicted
        Norms after 0 to `STEPS` gait steps, in SI units: of the motion, and by the derivative.
    errors
        Norms of the difference of both, relative to the prediction.
    """

    measured: Array
    predicted: Array
    errors: Array


@dataclass(frozen=True)
class Margins:
    """How far a cycle is from another order of events.

    Attributes
    ----------
    between
        Least time between two events [s].
    to_sample
        Least time between an event and a sample of the controller [s].
    guards
        Least value of a guard that does not fire, and its description, by unit.
    nonsmooth
        Reasons against the derivative, with time from the start of the cycle [s] and margin.
    """

    between: float
    to_sample: float
    guards: dict[str, tuple[float, str]]
    nonsmooth: Sequence[tuple[str, float, float]]


def decay(orbit: Orbit) -> Decay:
    """Compare the decay of a deviation over gait steps with the derivative.

    The deviation is half the difference of two motions that start on both sides of the orbit, so
    that terms of even order cancel.
    """
    strobe, basis = orbit.strobe, orbit.derivative.basis
    P = np.linalg.matrix_power(orbit.derivative.P, _FADE)
    direction = P @ np.random.default_rng(0).normal(size=len(P))
    direction = basis @ (direction / np.linalg.norm(direction))
    growth = float(np.linalg.norm(_predicted(orbit, direction), axis=1).max())
    size = min(_SMALL, _LARGEST / growth)
    starts = [strobe.displaced(orbit.start, sign * size * direction) for sign in (1.0, -1.0)]
    sides = [_followed(orbit, start) for start in starts]
    measured = 0.5 * (sides[0] - sides[1])
    predicted = _predicted(orbit, measured[0])
    kept = orbit.derivative.kept
    norms = np.linalg.norm(predicted[:, kept], axis=1)
    errors = np.linalg.norm((measured - predicted)[:, kept], axis=1) / norms
    return Decay(np.linalg.norm(measured[:, kept], axis=1), norms, errors)


def _predicted(orbit: Orbit, deviation: Array) -> Array:
    """Return a deviation (s,) and its images after each gait step (STEPS + 1, s)."""
    strobe, steps = orbit.strobe, orbit.start.steps
    path = [deviation]
    for step in range(STEPS):
        image = strobe.reduction @ orbit.derivative.parts[step % steps].A @ path[-1]
        last = step % steps == steps - 1
        path.append(strobe.back(steps) @ image if last else image)
    return np.array(path)


def _followed(orbit: Orbit, start: Start) -> Array:
    """Relative states at a start and after each gait step, mirrored back after each cycle."""
    strobe, steps = orbit.strobe, start.steps
    path, mirrored = [strobe.at(start)], np.eye(len(strobe.mirror))
    for step in range(STEPS):
        cycle, part = divmod(step, steps)
        moved = replace(start, tick=start.tick + cycle * start.samples)
        strobe.advance(start, moved.ends()[part])
        if part == steps - 1:
            mirrored = strobe.back(steps) @ mirrored
        path.append(mirrored @ strobe.state)
    return np.array(path)


def margins(orbit: Orbit) -> Margins:
    """Measure how far a cycle is from another order of events."""
    start, sim = orbit.start, orbit.strobe.sim
    begin = start.tick * start.period
    lins = orbit.derivative.parts
    times = np.array([event["time"] for lin in lins for event in lin.events]) - begin
    off = np.abs(times / start.period - np.round(times / start.period)) * start.period
    # An event of a sample is at it.
    free = [event["guard_rate"] is not None for lin in lins for event in lin.events]
    least: dict[str, tuple[float, str]] = {}
    sim.restore(start.snapshot)
    for tick in range(1, start.samples):
        t = tick * start.period
        orbit.strobe.advance(start, begin + t)
        if np.abs(times - t).min() > _APART:
            for guard, value in sim.guards(sim.time, sim.q, sim.v).items():
                known = least.get(_unit(guard), (math.inf, ""))
                if guard != "fall" and abs(value) < known[0]:
                    least[_unit(guard)] = (abs(value), f"{guard} (state {sim.state_number})")
    reasons = [(why, t - begin, margin) for lin in lins for why, t, margin in lin.nonsmooth]
    return Margins(float(np.diff(times).min()), float(off[free].min()), least, reasons)


def _unit(guard: str) -> str:
    """Return the unit of a guard's value."""
    if "lands" in guard:
        return "m"
    return "m/s" if guard.endswith(("stops", "slows down")) else "N"


def states(orbit: Orbit) -> list[int]:
    """Return the contact states of a cycle in order, without those of less than 2 ms."""
    start, sim = orbit.start, orbit.strobe.sim
    sim.restore(start.snapshot)
    changes = [(start.tick * start.period, sim.state_number)]
    for lin in orbit.derivative.parts:
        changes += [(event["time"], event["state_after"]) for event in lin.events]
    ends = [t for t, _ in changes[1:]] + [(start.tick + start.samples) * start.period]
    order: list[int] = []
    for (t, state), end in zip(changes, ends, strict=True):
        if end - t >= _VISIT and order[-1:] != [state]:
            order.append(state)
    return order


def returning(orbit: Orbit, seed: int) -> float:
    """Bisect the largest perturbation in a random direction that returns [rad, rad/s].

    The perturbation is normal noise of this standard deviation on all angles and velocities,
    projected onto the constraints. It returns if the state at a section comes nearer to the orbit
    than a tenth of the perturbation, within `_RETURN_STEPS`, or twice the number that the slowest
    multiplier needs for it. The motion may be whole samples early or late. The orbit must be stable
    and its cycle one gait step.
    """
    radius = np.abs(np.linalg.eigvals(orbit.derivative.P)).max()
    steps = max(_RETURN_STEPS, math.ceil(2.0 * math.log(_RETURNED) / math.log(radius)))
    noise = np.random.default_rng(seed).normal(size=2 * orbit.strobe.n + 4)
    noise[0] = 0.0
    noise[2 * orbit.strobe.n :] = 0.0
    size = _LARGEST_NOISE
    while size > _LEAST_NOISE and not _comes_back(orbit, size * noise, steps):
        size *= 0.5
    if size <= _LEAST_NOISE:
        return 0.0
    low, high = size, 2.0 * size
    for _ in range(_HALVINGS):
        middle = math.sqrt(low * high)
        if _comes_back(orbit, middle * noise, steps):
            low = middle
        else:
            high = middle
    return low


def _comes_back(orbit: Orbit, noise: Array, most: int) -> bool:
    strobe, basis = orbit.strobe, orbit.derivative.basis
    begun = strobe.displaced(orbit.start, noise)
    deviation = basis.T @ strobe.at(begun)
    orbit_state = basis.T @ strobe.at(orbit.start)
    limit = _RETURNED * np.linalg.norm(deviation - orbit_state)
    strobe.sim.restore(begun.snapshot)
    walk = sections(strobe, orbit.start.period)
    for steps, section in enumerate(islice(walk, most), 1):
        state = basis.T @ strobe.back(steps) @ section.state
        if np.linalg.norm(state - orbit_state) < limit:
            return True
    return False


def slide(orbit: Orbit) -> float:
    """Return the displacement of the supporting feet while sliding, in a cycle [m]."""
    sim = orbit.strobe.sim
    sim.restore(orbit.start.snapshot)
    before = sim.totals()["slide"]
    orbit.strobe.advance(orbit.start, (orbit.start.tick + orbit.start.samples) * orbit.start.period)
    return float(sim.totals()["slide"] - before)


def path(orbit: Orbit, cycles: int) -> tuple[Array, Array, NDArray[np.bool_]]:
    """Sample some cycles every 1 ms.

    Returns coordinates (T, n), velocities (T, n), and whether the left leg supports (T,).
    """
    start, sim = orbit.start, orbit.strobe.sim
    sim.restore(start.snapshot)
    q, v, left = [sim.q], [sim.v], [sim.support_leg == "left"]
    for tick in range(1, start.samples * cycles + 1):
        orbit.strobe.advance(start, (start.tick + tick) * start.period)
        q.append(sim.q)
        v.append(sim.v)
        left.append(sim.support_leg == "left")
    return np.array(q), np.array(v), np.array(left)
