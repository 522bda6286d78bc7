"""A cycle in parts: flows between events and the events themselves; determinants of both.

In a smooth part the derivative G of the flow in orthonormal bases of the tangent space obeys
Liouville's formula, det G = exp of the integral of the trace of the vector field's derivative in
that space. The trace comes from differences of `Simulator.rhs`, G from `Simulator.linearize`: two
separate codes.
"""

import copy
import math
from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.linalg import null_space, schur

from skate_env._core import Simulator

from .close import Orbit
from .strobe import Flow

Array = NDArray[np.float64]

# Distance of the ends of the parts from an event [s].
_BESIDE = 1e-9
# Step of differences of the right-hand side [rad, m, and their rates].
_STEP = 1e-6
# Duration of the flow of which the determinant is checked [s], and nodes of the integral. Some
# rates decay at 1e4 /s; over a longer step the integrator's factor for them is not the exponential.
_SHORT, _NODES = 2e-5, 2
# Multipliers below this are left out of the product.
SMALLEST = 1e-3
# Singular values and entries of memory below this are zero.
_NULL = 1e-10


@dataclass(frozen=True)
class Part:
    """Part of a gait step.

    Attributes
    ----------
    before
        Simulator at the start of the part.
    torque
        Residual torque at its start (joints,) [N m], None for zero.
    lin
        Linearization.
    event
        Whether the part contains an event, or events closer than the parts separate.
    """

    before: Simulator
    torque: Array | None
    lin: Flow
    event: bool


@dataclass(frozen=True)
class Determinants:
    """Checks of a cycle's determinants; of its first gait step if it has more than two.

    Attributes
    ----------
    liouville
        Largest deviation of log det G from the integral of the trace, over the first 20 us of all
        smooth parts.
    product
        Product of the multipliers above `SMALLEST` in magnitude; NaN for a longer cycle.
    composed
        The same from the parts: the growth of volume in these multipliers' invariant space.
    structural
        Dimension of the reduced tangent space less the smallest dimension that the cycle passes:
        the number of multipliers that are zero by construction.
    """

    liouville: float
    product: float
    composed: float
    structural: int


def parts(orbit: Orbit) -> list[Part]:
    """Split a cycle, or the first of more than two gait steps, at samples and beside events."""
    strobe, start = orbit.strobe, orbit.start
    number = start.steps if start.steps <= 2 else 1
    sim = strobe.sim
    sim.restore(start.snapshot)
    found = []
    for end, flow in zip(start.ends()[:number], orbit.derivative.parts, strict=False):
        ticks = range(round(sim.time / start.period) + 1, round(end / start.period))
        samples = start.period * np.array(ticks, dtype=float)
        times = [one["time"] for one in flow.events]
        for until, event in _cuts((sim.time, end), times, samples):
            before, torque = copy.copy(sim), strobe.torque(start)
            lin = strobe.linearize(start, until)
            # Events within a microsecond may occur elsewhere in pieces than in the whole.
            found.append(Part(before, torque, lin, event or bool(lin.events)))
    return found


def _cuts(
    ends: tuple[float, float], events: list[float], samples: Array
) -> Iterator[tuple[float, bool]]:
    """Return the ends of the parts, and whether each contains an event."""
    last, end = ends
    for event in [*events, math.inf]:
        if event + _BESIDE <= last:
            continue
        until = min(event - _BESIDE, end)
        if until > last + _BESIDE:
            inside = samples[(samples > last + _BESIDE) & (samples < until - _BESIDE)]
            yield from ((one, False) for one in [*inside.tolist(), until])
        if event < math.inf:
            last = min(event + _BESIDE, end)
            yield last, True


def check(orbit: Orbit) -> Determinants:
    """Compute the determinants of a cycle's parts in two ways."""
    found = parts(orbit)
    deviations = [_liouville(part, orbit.strobe.n) for part in found if not part.event]
    product = composed = np.nan
    if orbit.start.steps <= 2:
        product, composed = _products(orbit, found)
    return Determinants(max(deviations), product, composed, _structural(orbit, found))


def _liouville(part: Part, n: int) -> float:
    """Deviation of log det G from the integral of the trace, at the start of a smooth part."""
    begin, end = part.lin.time
    half = 0.5 * min(end - begin, _SHORT)
    lin = part.before.linearize(part.torque, until=begin + 2.0 * half)
    G = _velocities(lin.tangent_after, n).T @ lin.A @ _velocities(lin.tangent_before, n)
    walker, integral = copy.copy(part.before), 0.0
    for node, weight in zip(*np.polynomial.legendre.leggauss(_NODES), strict=True):
        walker.advance(begin + half * (1.0 + node), part.torque)
        integral += half * weight * _trace(walker, n)
    return abs(float(np.linalg.slogdet(G)[1]) - integral)


def _velocities(tangent: Array, n: int) -> Array:
    """Return an orthonormal basis of the directions at constant memory."""
    constant = null_space(tangent[2 * n :], rcond=_NULL)
    basis: Array = tangent @ constant
    return basis


def _trace(sim: Simulator, n: int) -> float:
    """Trace of the vector field's derivative in the tangent space at constant memory [1/s]."""
    basis = _velocities(sim.linearize(until=sim.time + _BESIDE).tangent_before, n)
    q, v, t = sim.q, sim.v, sim.time
    total = 0.0
    for dq, dv in zip(basis[:n].T, basis[n : 2 * n].T, strict=True):
        ends = [sim.rhs(t, q + h * dq, v + h * dv) for h in (_STEP, -_STEP)]
        total += float(dq @ dv + dv @ (ends[0] - ends[1]) / (2.0 * _STEP))
    return total


def _products(orbit: Orbit, found: list[Part]) -> tuple[float, float]:
    """Product of the large multipliers, and the same through all parts."""
    P, basis = orbit.derivative.P, orbit.derivative.basis
    form, vectors, r = schur(P, sort=lambda re, im=0.0: abs(complex(re, im)) > SMALLEST)
    W = start = basis @ vectors[:, :r]
    composed = 1.0
    for part in found:
        W, R = np.linalg.qr(orbit.strobe.reduction @ part.lin.A @ W)
        composed *= float(np.prod(np.diag(R)))
    composed *= float(np.linalg.det(start.T @ orbit.strobe.back(orbit.start.steps) @ W))
    return float(np.linalg.det(form[:r, :r])), composed


def _structural(orbit: Orbit, found: list[Part]) -> int:
    """Count the multipliers that are zero by construction."""
    strobe, n = orbit.strobe, orbit.strobe.n
    size = len(strobe.mirror)
    reduced = [strobe.reduction @ part.lin.A for part in found]
    cycle = np.eye(size)
    for A in reduced:
        cycle = A @ cycle
    # Derivatives of a cycle later by the state before each part, and by that a cycle earlier.
    later, earlier = [cycle], cycle
    for A in reduced[::-1]:
        later.insert(0, later[0] @ A)
    least = len(orbit.derivative.P)
    for part, A, rest in zip(found, reduced, later, strict=False):
        dead = [
            j
            for j in range(2 * n, size)
            if np.abs(rest[:, j]).max() < _NULL or np.abs(earlier[j]).max() < _NULL
        ]
        unread = [*dead, *orbit.derivative.unread]
        least = min(least, strobe.basis(part.lin.tangent_before, unread).shape[1])
        earlier = A @ earlier
    return len(orbit.derivative.P) - least
