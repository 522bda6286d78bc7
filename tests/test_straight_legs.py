"""Legs that are almost straight: the limit of small bends, or an end with a name."""

import numpy as np
import pytest

from skate_env import Simulator
from skate_env.scenes import replace
from skate_env.studies.hardcases.fixtures import push_only, standing

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


def from_the_other_foot(sim, q, v):
    """Coordinates and velocities of a robot in the air, with the other foot as the root."""

    def renamed(q):
        # Joints 3 to 8 lead from one foot to the other.
        _, y, z = sim.link_segments(q)[6][1]
        return np.concatenate(([y, z, q[2:9].sum()], -q[3:9][::-1], q[9:]))

    h = 1e-6
    return renamed(q), (renamed(q + h * v) - renamed(q - h * v)) / (2.0 * h)


def landings(drop, seed, accuracy="balanced"):
    """Land on both straight legs; the same motion described from either foot."""
    rng = np.random.default_rng(seed)
    scene = replace(push_only(standing()), {"accuracy": accuracy})
    sims = [Simulator(scene) for _ in range(2)]
    q, v = np.zeros(19), rng.uniform(-0.5, 0.5, 19)
    # Both feet come down flat.
    q[1], v[:3] = drop, (2.0 * v[0], -0.3, 0.0)
    v[8] -= v[3:9].sum()
    sims[0].reset(q=q, v=v, support_leg="left")
    other = from_the_other_foot(sims[0], q, v)
    sims[1].reset(q=other[0], v=other[1], support_leg="right")
    for sim in sims:
        sim.check_laws()
        sim.advance(0.05)
    return sims


@pytest.mark.parametrize("seed", range(12))
def test_a_landing_does_not_depend_on_the_root(seed):
    # Forces on straight legs are not determined; their choice must not depend on the root.
    one, other = (sim.link_segments()[9:, :, 1:] for sim in landings(0.0, seed, "reference"))
    # 7e-11 m, from differences in the velocities; 1e-5 before.
    np.testing.assert_allclose(one, other, rtol=0.0, atol=1e-9)


@pytest.mark.parametrize("drop", [1e-3, 1e-5, 1e-6, 1e-7, 1e-8, 0.0])
def test_no_law_is_broken_at_a_landing_on_straight_legs(drop):
    # A leg with a bend of 1e-6 cannot become longer; corrections of its foot moved robots by 4e4 m.
    for seed in range(8):
        for sim in landings(drop, seed):
            # Forces may have no correct digit, as above.
            assert sim.termination in (None, "singular")
            assert [law for law in sim.laws() if law["count"]] == [], seed
