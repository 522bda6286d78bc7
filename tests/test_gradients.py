"""Derivatives of a motion through its events: laws, and agreement with extrapolated differences."""

import copy

import numpy as np
import pytest

import skate_env
from skate_env import Simulator, load_scene
from skate_env.scenes import replace
from skate_env.studies.fixtures import BLADE, PAPER_DAMPED

PRESETS = [*skate_env.scene_names(), PAPER_DAMPED, BLADE]
SMOOTH = [name for name in PRESETS if name != BLADE]
RK4 = {"method": "rk4", "step": 0.001}
DOPRI5 = {"method": "dopri5", "tolerance": 1e-13}
PARAMETERS = [
    "ice.gravity",
    "body.head.mass",
    "body.upper_leg.mass",
    "control.lifting.K_p.2",
    "control.lifting.height",
    "control.feedforward.scale",
    "control.feedforward.tau1_scale",
]


def some(names, quick):
    """Parameters of a test: the scenes of `quick` in the quick tier, the others in the long one."""
    long = pytest.mark.long("the same in further scenes")
    return [name if name in quick else pytest.param(name, marks=long) for name in names]


def started(name, accuracy, seconds=0.0):
    """Start a preset with another accuracy, after some time, and random torques [N m]."""
    sim = Simulator(replace(load_scene(name), {"accuracy": accuracy}))
    if seconds > 0.0:
        sim.advance(seconds)
    sim.take_events()
    return sim, np.random.default_rng(0).uniform(-3.0, 3.0, len(sim.q) - 3)


def end_of(sim, until, torque):
    """Advance; return the final state and the guards passed, in order."""
    sim.take_events()
    sim.advance(until, torque)
    return sim.state_vector(), [event[1:] for event in sim.take_events()]


def extrapolated(value, step):
    """Central difference quotient of ``value(e)`` at 0, extrapolated twice, and its error.

    None if an event changes.
    """
    ends, sequences = {}, []
    for k in (1, 2, 4):
        for sign in (1, -1):
            ends[sign * k], passed = value(sign * step * k / 4)
            sequences.append(passed)
    if any(passed != sequences[0] for passed in sequences):
        return None
    d1, d2, d4 = ((ends[k] - ends[-k]) / (step * k / 2) for k in (1, 2, 4))
    finer, coarser = (4 * d1 - d2) / 3, (4 * d2 - d4) / 3
    best = (16 * finer - coarser) / 15
    return best, np.abs(best - finer).max()


def difference(value, step):
    """Most accurate quotient over several steps.

    A large step may move an event over a sample of the controller, which only the error shows.
    """
    quotients = [extrapolated(value, step * 8.0**-k) for k in range(5)]
    quotients = [quotient for quotient in quotients if quotient is not None]
    if not quotients:
        pytest.fail("every perturbation changes the sequence of events")
    return min(quotients, key=lambda quotient: quotient[1])[0]


def size_of(matrix):
    """Largest entry, at least 1."""
    return max(1.0, np.abs(matrix).max())


def check_differences(sim, torque, until, lin, tolerance):
    """Compare products with random directions with differences; returns the largest error."""
    rng, worst = np.random.default_rng(1), 0.0

    def moved(e, dx, du):
        other = copy.copy(sim)
        other.displace(e * dx)
        return end_of(other, until, torque + e * du)

    for k in range(6):
        dx, du = rng.normal(size=lin.A.shape[1]), rng.normal(size=len(torque))
        if k % 2 == 0:
            du[:] = 0.0
        else:
            dx[:] = 0.0
        step = 2e-4 if k % 2 == 0 else 1e-2
        found = difference(lambda e, dx=dx, du=du: moved(e, dx, du), step)
        exact = lin.A @ dx + lin.B @ du
        worst = max(worst, np.abs(found - exact).max() / size_of(exact))
    assert worst < tolerance, worst
    return worst


@pytest.mark.parametrize("accuracy", [1e-13, DOPRI5, RK4], ids=["dop853", "dopri5", "rk4"])
@pytest.mark.parametrize("name", some(SMOOTH, ("paper", "push_only")))
def test_derivatives_agree_with_differences(name, accuracy):
    sim, torque = started(name, accuracy)
    # Fixed steps of 1 ms set the two guards of a swap of `paper` (0.2008 s) 5 ns apart.
    before_swap = (name, accuracy) == ("paper", RK4)
    for until in (0.05, 0.19 if before_swap else 0.3):
        lin = sim.linearize(torque, until)
        assert not lin.nonsmooth
        check_differences(sim, torque, until, lin, 1e-7)


@pytest.mark.parametrize("name", some(PRESETS, ("paper", "push_only")))
def test_derivatives_through_a_cycle_of_events(name):
    sim, torque = started(name, "reference", 0.3)
    kinds = 0
    for _ in range(40):
        until = sim.time + 0.02
        try:
            lin = sim.linearize(torque, until)
        except ValueError:
            break
        if lin.events and not lin.nonsmooth:
            check_differences(sim, torque, until, lin, 1e-5)
            kinds += len(lin.events)
        sim.advance(until, torque)
    assert kinds > 0


@pytest.mark.parametrize(
    ("accuracy", "times", "tolerance"),
    [(RK4, (0.06, 0.065, 0.12), 1e-11), ("reference", (0.0, 0.1, 0.2), 1e-7)],
    ids=["rk4", "reference"],
)
@pytest.mark.parametrize("name", SMOOTH)
def test_jacobians_compose(name, accuracy, times, tolerance):
    """With fixed steps the parts have the steps of the whole, and only rounding differs.

    No event is before the end of the first part, because steps after an event depend on the end.
    """
    start, middle, end = times
    sim, torque = started(name, accuracy, start)
    params = [p for p in PARAMETERS if p in sim.scene.parameters()]
    whole = sim.linearize(torque, end, params)
    first = sim.linearize(torque, middle, params)
    sim.advance(middle, torque)
    second = sim.linearize(torque, end, params)
    for found, exact in (
        (second.A @ first.A, whole.A),
        (second.A @ first.B + second.B, whole.B),
        (second.A @ first.P + second.P, whole.P),
    ):
        assert np.abs(found - exact).max() < tolerance * size_of(exact)


@pytest.mark.parametrize("name", PRESETS)
def test_the_tangent_space_is_mapped_into_the_tangent_space(name):
    sim, torque = started(name, "reference", 0.3)
    for _ in range(20):
        until = sim.time + 0.02
        try:
            lin = sim.linearize(torque, until)
        except ValueError:
            break
        before, after = lin.tangent_before, lin.tangent_after
        assert np.abs(before.T @ before - np.eye(before.shape[1])).max() < 1e-12
        for image in (lin.A, lin.A @ before, lin.B):
            off = image - after @ (after.T @ image)
            assert np.abs(off).max() < 1e-9 * size_of(image)
        sim.advance(until, torque)


@pytest.mark.parametrize("name", PRESETS)
def test_a_translation_is_a_symmetry(name):
    """Feet and anchor move together; nothing else changes."""
    sim, torque = started(name, "reference")
    n = len(sim.q)
    lin = sim.linearize(torque, 0.3)
    shift = np.zeros(2 * n + 4)
    shift[[0, 2 * n]] = 1.0
    moved = lin.A @ shift
    assert abs(moved[0] - 1.0) < 1e-10
    assert np.abs(np.delete(moved, [0, 2 * n])).max() < 1e-9


@pytest.mark.parametrize("name", SMOOTH)
def test_event_times_and_saltation_matrices(name):
    sim, torque = started(name, "reference")
    until = 0.3
    lin = sim.linearize(torque, until)
    rng = np.random.default_rng(2)
    dx = rng.normal(size=lin.A.shape[1])
    dx[2 * len(sim.q) :] = 0.0

    def times(e):
        other = copy.copy(sim)
        other.displace(e * dx)
        other.take_events()
        other.advance(until, torque)
        events = other.take_events()
        return np.array([event[0] for event in events]), [event[1:] for event in events]

    found = difference(times, 1e-4)
    known = {round(event["time"], 9): event["dt_dx"] @ dx for event in lin.events}
    exact = [known[round(t, 9)] for t in times(0.0)[0]]
    assert np.abs(found - exact).max() < 1e-6 * max(1.0, np.abs(exact).max())
    # The flow before the event, its saltation matrix and the flow after it are the whole.
    gap = 1e-9
    for event in lin.events:
        t = event["time"]
        if event["guard_rate"] is None:
            continue
        before, later = copy.copy(sim), copy.copy(sim)
        first = before.linearize(torque, t - gap)
        later.advance(t + gap, torque)
        second = later.linearize(torque, until)
        product = second.A @ event["saltation"] @ first.A
        assert np.abs(product - lin.A).max() < 1e-5 * size_of(lin.A), event["guards"]


@pytest.mark.parametrize("name", some(SMOOTH, ("paper", "push_only")))
def test_derivatives_by_parameters(name):
    sim, torque = started(name, "reference")
    until, values = 0.3, sim.scene.parameters()
    friction = [p for p in values if p.startswith("ice.friction.mu")]
    params = friction + [p for p in PARAMETERS if p in values]
    lin = sim.linearize(torque, until, params)
    assert lin.P.shape == (lin.A.shape[0], len(params))
    for column, param in zip(lin.P.T, params, strict=True):
        value = values[param][0]

        def changed(e, param=param, value=value):
            other = copy.copy(sim)
            other.reset(params={param: value + e})
            return end_of(other, until, torque)

        found = difference(changed, 2e-3 * max(abs(value), 1e-3))
        error = np.abs(found - column).max() / size_of(column)
        assert error < 1e-6, (param, error)


def momentum_gradient(sim):
    """Differentiate the linear momentum (2,) by the state."""
    q, v = sim.q, sim.v
    n = len(q)
    gradient = np.zeros((2, 2 * n + 4))
    for i in range(2 * n):
        dq, dv = np.eye(2 * n)[i][:n], np.eye(2 * n)[i][n:]

        def momentum(e, dq=dq, dv=dv):
            return sim.momentum(q + e * dq, v + e * dv)[:2], []

        # Linear in the velocities.
        gradient[:, i] = extrapolated(momentum, 1.0 if i >= n else 1e-2)[0]
    return gradient


def test_momentum_is_conserved_in_flight():
    """No torque between bodies changes the momentum: dm(x_T) = dm(x_0)."""
    sim, torque = started("push_only", "reference", 0.3)
    assert sim.state_number == 0 and (sim.gaps() > 1e-3).all()
    lin = sim.linearize(torque, 0.32)
    assert not lin.events
    before = momentum_gradient(sim)
    sim.advance(0.32, torque)
    after = momentum_gradient(sim)
    assert np.abs(after @ lin.A - before).max() < 1e-10 * size_of(before)
    assert np.abs(after @ lin.B).max() < 1e-10 * size_of(before)


def test_newton_converges_through_events():
    sim, _ = started(PAPER_DAMPED, 5e-6)
    line, speed = 0.25, len(sim.q)
    misses = []
    for _ in range(5):
        end = copy.copy(sim)
        end.advance(0.3)
        misses.append(abs(end.q[0] - line))
        step = np.zeros(len(sim.state_vector()))
        step[speed] = -(end.q[0] - line) / sim.linearize(until=0.3).A[0, speed]
        sim.displace(step)
    assert misses[0] > 0.01 and misses[2] < 1e-5 and misses[4] < 1e-11


def test_the_simulator_does_not_change():
    sim, torque = started(PAPER_DAMPED, "balanced", 0.1)
    before = sim.snapshot()
    sim.linearize(torque, 0.2)
    assert sim.snapshot() == before


def test_arguments_are_checked():
    sim, torque = started("paper", "balanced")
    for arguments in ((torque[1:],), (torque, -1.0), (torque, 0.1, ["ice.colour"])):
        with pytest.raises(ValueError):
            sim.linearize(*arguments)
    with pytest.raises(ValueError, match="start"):
        sim.linearize(torque, 0.1, ["start.v.y0"])
    with pytest.raises(ValueError, match="by parameters need"):
        started("paper", "fast")[0].linearize(torque, 0.1, ["ice.gravity"])
    implicit, _ = started("paper", {"method": "rosenbrock", "tolerance": 1e-5})
    with pytest.raises(ValueError, match="accuracy"):
        implicit.linearize(torque)
