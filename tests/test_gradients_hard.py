"""Derivatives in the scenes of the hard cases, and over 100 steps: no NaN without a flag."""

import numpy as np
import pytest

from skate_env import Scene, Simulator
from skate_env.scenes import replace
from skate_env.studies.fixtures import PAPER_DAMPED
from skate_env.studies.hardcases.case import CaseContext
from skate_env.studies.hardcases.catalogue import CASES

# Cases with more scenes than this draw them at random.
_MOST_SCENES = 16


def scenes_of_hard_cases():
    """Texts of the scenes that the cases build, without repetitions."""
    texts = {}
    for case in CASES.values():
        context = CaseContext("balanced")
        case.measure(context)
        own = dict.fromkeys(scene.to_toml() for scene in context.scenes)
        if len(own) <= _MOST_SCENES:
            texts |= own
    return texts


def flagged(lin, reason):
    return any(found == reason for found, *_ in lin.nonsmooth)


@pytest.mark.long("measures all hard cases for their scenes")
def test_derivatives_are_finite_or_flagged_in_the_hard_cases():
    """Grazing, simultaneous landings, chattering, straight legs, violent starts and others."""
    # `balanced` without its implicit method, whose steps have no derivatives.
    accuracy = {"method": "dop853", "tolerance": 5e-6}
    parts, dependent = 0, 0
    for text in scenes_of_hard_cases():
        try:
            sim = Simulator(replace(Scene.from_toml(text), {"accuracy": accuracy}))
        except ValueError:  # Cases of starts that are refused.
            continue
        for _ in range(10):
            until = sim.time + 0.02
            try:
                lin = sim.linearize(until=until)
            except ValueError as error:
                assert "the motion ends" in str(error)
                break
            is_finite = np.isfinite(lin.A).all() and np.isfinite(lin.B).all()
            assert is_finite or flagged(lin, "dependent"), text
            parts += 1
            dependent += flagged(lin, "dependent")
            sim.advance(until)
    assert parts > 500 and dependent > 0


@pytest.mark.long("100 steps of a gait")
def test_derivatives_stay_finite_over_100_steps():
    """The product of all Jacobians, applied to one direction."""
    sim = Simulator(PAPER_DAMPED)
    x, steps = np.random.default_rng(0).normal(size=len(sim.state_vector())), 0
    while steps < 100:
        x = sim.linearize().A @ x
        assert np.isfinite(x).all()
        assert sim.step()
        steps += len(sim.take_steps())
    # The gait is stable but for the symmetries: position and time.
    assert np.abs(x).max() < 1e6
