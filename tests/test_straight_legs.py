"""Legs that are almost straight: the limit of small bends, or an end with a name."""

import numpy as np
import pytest

from skate_env import Simulator
from skate_env.scenes import replace
from skate_env.studies.hardcases.fixtures import standing

TORQUE = -20.0  # On the free knee, against the other leg [N m].


def pushed(bend):
    """Stand on both feet with knees bent by ``bend`` [rad], pushed by one of them for 0.1 us."""
    half, names = 0.5 * bend, ("q2", "q3", "q4", "q5", "q6", "q7")
    posture = dict(zip(names, (-half, bend, -half, half, -bend, half), strict=True))
    sim = Simulator(replace(standing(), {"start.q": posture}))
    torque = np.zeros(len(sim.q) - 3)
    torque[sim.coordinate_names.index("q6") - 3] = TORQUE
    sim.advance(1e-7, torque)
    return sim


@pytest.mark.parametrize("bend", [1e-5, 8e-6, 5e-6, 3e-6, 2e-6, 1e-6])
def test_accelerations_have_a_limit(bend):
    # With sticking feet the force between the legs grows like 1 / bend, so a foot slides.
    large, small = pushed(1e-4), pushed(bend)
    assert small.termination is None
    assert small.state_number == large.state_number == 13
    size = np.abs(large.acceleration).max()
    # 5e-3; the sticking feet were given up before, and a knee had four times the acceleration.
    assert np.abs(small.acceleration - large.acceleration).max() < 0.02 * size


@pytest.mark.parametrize("bend", [1e-7, 1e-8])
def test_a_force_without_a_correct_digit_has_a_name(bend):
    assert pushed(bend).termination == "singular"


def test_straight_legs_yield():
    sim = pushed(0.0)
    assert sim.termination is None
    # 2e-16 m and 9e-18 m/s.
    assert max(sim.violation()) < 1e-14
