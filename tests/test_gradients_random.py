"""Derivatives at random starts, and over whole cycles, against central differences.

The error of a difference has two parts: truncation, which the difference between two orders
estimates, and noise: the engine leaves violations of the constraints up to 1e-12 m and 1e-11 m/s
uncorrected, so that two motions differ by as much, whatever the step.
"""

import copy

import numpy as np
import pytest

import skate_env
from skate_env import Simulator, load_scene
from skate_env.scenes import replace
from tests.differences import difference

PRESETS = skate_env.scene_names()
# The differences need the tightest tolerance.
TOLERANCE = 1e-13


def end_of(sim, until, torque):
    """Advance; return the final state and the events: guards, and the sample before each."""
    sim.take_events()
    sim.advance(until, torque)
    period = sim.scene.parameters()["control.sample_period"][0]
    passed = [(*event[1:], int(event[0] // period)) for event in sim.take_events()]
    return sim.state_vector(), passed


def relative_error(sim, torque, until, lin, rng):
    """Compare A dx + B du along a random direction; relative to the largest entry, at least 1.

    An error within that of the difference quotient, at most 1e-6, counts as 0: next to another
    motion only the smallest displacements are regular, and rounding limits their quotient. None if
    every displacement changes the sequence of events.
    """
    dx, du = rng.normal(size=lin.A.shape[1]), rng.normal(size=len(torque))

    def moved(e):
        other = copy.copy(sim)
        other.displace(e * dx)
        return end_of(other, until, torque + e * du)

    exact = lin.A @ dx + lin.B @ du
    found = difference(moved)
    if found is None:
        return None
    scale = max(1.0, np.abs(exact).max())
    error, own = np.abs(found[0] - exact).max() / scale, found[1] / scale
    return 0.0 if error < own < 1e-6 else error


def random_action(name, rng):
    """Draw a state of the first 1.2 s, slightly displaced, and a torque [N m].

    A displacement of 1e-3 may leave a violation of 1e-12 m, which a later landing at 0.5 mm/s
    amplifies; a second one of 1e-8 leaves 1e-16 m, as those of the differences do.
    """
    sim = Simulator(replace(load_scene(name), {"accuracy": TOLERANCE}))
    joints = len(sim.q) - 3
    sim.advance(rng.uniform(0.0, 1.2), rng.uniform(-3.0, 3.0, joints))
    for size in (1e-3, 1e-8):
        sim.displace(size * rng.normal(size=len(sim.state_vector())))
    return sim, rng.uniform(-3.0, 3.0, joints)


def check_actions(name, seed, starts):
    """Compare over one action; return the kinds of events, and the number of flagged starts."""
    rng, kinds, flagged = np.random.default_rng(seed), set(), 0
    for _ in range(starts):
        sim, torque = random_action(name, rng)
        until = sim.time + sim.scene.parameters()["control.action_period"][0]
        try:
            lin = sim.linearize(torque, until)
        except ValueError:  # A fall.
            assert not sim.advance(until, torque)
            continue
        if lin.nonsmooth:
            flagged += 1
            continue
        error = relative_error(sim, torque, until, lin, rng)
        assert error is not None and error < 1e-7, (lin.events, error)
        kinds.update(guard for event in lin.events for guard in event["guards"])
    return kinds, flagged


@pytest.mark.parametrize("name", PRESETS)
def test_an_action_from_a_random_start(name):
    check_actions(name, 1, 6)


@pytest.mark.long("1,200 random starts")
@pytest.mark.parametrize("name", PRESETS)
def test_an_action_from_many_random_starts(name):
    """Largest error: see docs/gradients.md."""
    starts = 200
    kinds, flagged = check_actions(name, 2, starts)
    assert len(kinds) >= 5, kinds
    assert flagged <= 0.15 * starts


@pytest.mark.parametrize(
    "name",
    [
        "paper_arms",
        *(
            pytest.param(name, marks=pytest.mark.long("differences over a whole cycle"))
            for name in PRESETS
            if name != "paper_arms"
        ),
    ],
)
def test_a_whole_cycle(name):
    """From one swap of the legs to the second after it, nine to twelve kinds of events."""
    sim = Simulator(replace(load_scene(name), {"accuracy": TOLERANCE}))
    ahead, swaps, leg = copy.copy(sim), [], sim.support_leg
    while len(swaps) < 3:
        assert ahead.advance(ahead.time + 0.01)
        if ahead.support_leg != leg:
            swaps.append(ahead.time)
            leg = ahead.support_leg
    sim.advance(swaps[0] + 0.02)
    until, rng = swaps[2] + 0.02, np.random.default_rng(1)
    torque = rng.uniform(-1.0, 1.0, len(sim.q) - 3)
    lin = sim.linearize(torque, until)
    kinds = {guard for event in lin.events for guard in event["guards"]}
    assert len(kinds) >= 5
    for _ in range(2):
        assert relative_error(sim, torque, until, lin, rng) < 1e-5
