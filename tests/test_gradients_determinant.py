"""The determinant of a motion's Jacobian (Liouville), from the trace of the flow and its events."""

import copy

import numpy as np
import pytest

from skate_env import Simulator, load_scene
from skate_env.scenes import replace
from skate_env.studies.fixtures import PAPER_DAMPED

NODES, WEIGHTS = np.polynomial.legendre.leggauss(8)


# Without damping of feet and hands, which decays within a millisecond: the error control looks at
# the motion, so that derivatives along directions that decay so fast have larger errors.
SLOW = {"body.foot.damping": 0.0, "body.hand.damping": 0.0, "body.lower_arm.damping": 0.0}
WINDOW, PARTS = 2e-3, 40


def trace_of_flow(sim, moving, until, torque):
    """Integrate the trace of f_x over the entries ``moving``; there is no event before ``until``.

    Accelerations are quadratic in v, so that central differences are exact.
    """
    start, n, total = sim.time, len(sim.q), 0.0
    if until - start < 1e-12:
        return total
    rates = [i - n for i in moving if i >= n]
    for node, weight in zip(NODES, WEIGHTS, strict=True):
        there = copy.copy(sim)
        there.advance(start + (node + 1.0) / 2.0 * (until - start), torque)
        t, q, v = there.time, there.q, there.v
        for i in rates:
            e = np.eye(n)[i]
            slope = (there.rhs(t, q, v + e)[i] - there.rhs(t, q, v - e)[i]) / 2.0
            total += weight * (until - start) / 2.0 * slope
    return total


def determinant(sim, until, torque):
    """Return the logarithm of det A to ``until``, and the same from the trace and the events.

    None where the mode changes, or its constraints are no coordinates.
    """
    n, start, part = len(sim.q), sim.time, copy.copy(sim)
    period = sim.scene.get("control.sample_period")
    lin = sim.linearize(torque, until)
    bases = [basis[: 2 * n] for basis in (lin.tangent_before, lin.tangent_after)]
    moving, after = (np.flatnonzero(np.abs(b).max(axis=1) > 1e-9).tolist() for b in bases)
    changes = moving != after or (lin.A[2 * n :] != np.eye(2 * n + 4)[2 * n :]).any()
    if changes or any(len(moving) + 4 != basis.shape[1] for basis in bases):
        return None
    rows = np.ix_(moving, moving)
    found = exact = 0.0
    for event in lin.events:
        exact += np.linalg.slogdet(event["saltation"][rows])[1]
    # Short parts: products of determinants are exact, and the steps are short.
    ends = start + (until - start) / PARTS * np.arange(1, PARTS + 1)
    events = [event["time"] for event in lin.events]
    for end in ends:
        found += np.linalg.slogdet(part.linearize(torque, end).A[rows])[1]
        ticks = np.arange(np.ceil(part.time / period), end / period) * period
        for time in sorted({*ticks, *(time for time in events if part.time < time < end), end}):
            exact += trace_of_flow(part, moving, time, torque)
            part.advance(time, torque)
    return found, exact


@pytest.mark.parametrize(
    ("name", "seconds", "events"),
    [("paper", 0.0, 1), (PAPER_DAMPED, 0.0, 1), ("push_only", 0.3, 0)],
)
def test_determinant_of_a_motion(name, seconds, events):
    """Liouville: det A = exp(integral of the trace) times the determinants of the events.

    On one foot, with a change of sign of its normal force, and in flight: largest error 1e-11.
    """
    sim = Simulator(replace(load_scene(name), {"accuracy": 1e-13} | SLOW))
    sim.advance(seconds)
    torque = np.random.default_rng(0).uniform(-1.0, 1.0, len(sim.q) - 3)
    plain, with_events = 0, 0
    while plain < 5 or with_events < events:
        until = sim.time + WINDOW
        lin = sim.linearize(torque, until)
        # An event to another mode changes the dimension.
        keeps = all(event["state_before"] == event["state_after"] for event in lin.events)
        known = determinant(sim, until, torque) if keeps and (lin.events or plain < 5) else None
        if known is not None:
            found, exact = known
            assert abs(found - exact) < 1e-10, (sim.time, found - exact)
            plain, with_events = plain + (not lin.events), with_events + bool(lin.events)
        sim.advance(until, torque)
