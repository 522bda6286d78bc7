"""Derivatives of time stepping: those of its map with the contact modes held."""

import copy

import numpy as np
import pytest

from skate_env import Simulator, load_scene
from skate_env.scenes import replace
from skate_env.studies.fixtures import BLADE, PAPER_DAMPED
from tests.differences import difference


def started(name, seconds, rng):
    """Start `fast` at some time under random torques; return the simulator and the torques."""
    sim = Simulator(replace(load_scene(name), {"accuracy": "fast"}))
    torque = rng.uniform(-3.0, 3.0, len(sim.q) - 3)
    sim.step(torque)
    if seconds > sim.time:
        sim.advance(seconds, torque)
    # The velocities of a step satisfy the constraints at its middle; a displaced start at its end.
    sim.displace(np.zeros(len(sim.state_vector())))
    return sim, torque


def relative_error(sim, torque, rng):
    """Compare an action along a random direction; return the error, and the events.

    None where every displacement changes the steps or the events.
    """
    until = sim.time + 0.01
    lin = sim.linearize(torque, until)
    dx, du = rng.normal(size=lin.A.shape[1]), rng.normal(size=len(torque))

    def end(e):
        other = copy.copy(sim)
        other.displace(e * dx)
        other.take_events()
        steps = other.stats()["steps"]
        other.advance(until, torque + e * du)
        events = tuple(event[1:] for event in other.take_events())
        return other.state_vector(), (events, other.stats()["steps"] - steps, other.state_number)

    exact = lin.A @ dx + lin.B @ du
    found = difference(end, noise=1e-10)
    if found is None:
        return None
    error = np.abs(found[0] - exact).max() / max(1.0, np.abs(exact).max())
    return error, [event[0] for event in end(0.0)[1][0]]


@pytest.mark.parametrize("name", ["paper", PAPER_DAMPED, "paper_arms", BLADE, "push_only"])
def test_an_action_without_changes_of_contact_agrees_with_differences(name):
    """Largest error of 24 to 37 actions of each preset: 1e-7.

    Changes of contact are located to 10 um only; see docs/gradients.md.
    """
    rng, compared = np.random.default_rng(0), 0
    for _ in range(40):
        sim, torque = started(name, rng.uniform(0.0, 1.0), rng)
        try:
            known = relative_error(sim, torque, rng)
        except ValueError:  # A fall.
            continue
        if known is not None and not known[1]:
            assert known[0] < 1e-6, sim.time
            compared += 1
    assert compared >= 20


@pytest.mark.parametrize("name", ["paper", "push_only"])
def test_derivatives_are_finite_through_changes_of_contact(name):
    sim, torque = started(name, 0.0, np.random.default_rng(1))
    x, events = np.random.default_rng(2).normal(size=len(sim.state_vector())), 0
    for _ in range(60):
        lin = sim.linearize(torque)
        x = lin.A @ x
        assert np.isfinite(lin.A).all() and np.isfinite(lin.B).all() and np.isfinite(x).all()
        sim.take_events()
        sim.step(torque)
        passed = len(sim.take_events())
        # Where both feet change, a step may log fewer events than changes.
        assert bool(passed) == any(reason == "contact_change" for reason, *_ in lin.nonsmooth)
        events += passed
    assert events > 4


def test_the_simulator_does_not_change():
    sim, torque = started("push_only", 0.1, np.random.default_rng(0))
    before, other = sim.snapshot(), copy.copy(sim)
    lin = sim.linearize(torque)
    assert sim.snapshot() == before and lin.events == [] and np.isfinite(lin.A).all()
    # The same motion as of a step.
    other.step(torque)
    sim.advance(lin.time[1], torque)
    assert (sim.state_vector() == other.state_vector()).all()
