"""The robot in Drake, and its motions with CENIC. Timings are not asserted."""

import numpy as np
import pytest

from skate_env import Simulator
from tests.bench.drake_body import CenicMotion, DrakeRobot
from tests.bench.equal_steps import error
from tests.bench.located_steps import (
    DURATION,
    FLIGHT,
    LANDINGS,
    cenic_ends,
    ends,
    scene,
    simulators,
    starts,
)

pytest.importorskip("pydrake")


@pytest.fixture(scope="module")
def robot() -> DrakeRobot:
    return DrakeRobot(scene())


@pytest.mark.parametrize("case", [LANDINGS, FLIGHT])
def test_same_body(robot: DrakeRobot, case: str) -> None:
    """Mass matrix and bias agree to 4e-16."""
    for sim in simulators("balanced", starts(case, 5)):
        robot.check(sim)


def test_another_body_is_not_measured(robot: DrakeRobot) -> None:
    with pytest.raises(RuntimeError, match=r"Drake has another body: relative error .*e-0"):
        robot.check(Simulator(scene().with_values({"body.head.mass": 5.0})))


def test_flights_are_the_same(robot: DrakeRobot) -> None:
    """CENIC's error falls with the root of its accuracy: 6e-4 and 6e-5 rad."""
    begun = starts(FLIGHT, 4)
    limit = ends("reference", begun)
    coarse, fine = (error(cenic_ends(robot, each, begun), limit).median for each in (1e-4, 1e-6))
    assert fine < 2e-4 and 5.0 < coarse / fine < 20.0


def test_landings_differ_by_the_softness_of_the_contact(robot: DrakeRobot) -> None:
    """By up to 0.005 rad; without the ice by 0.36 rad."""
    begun = starts(LANDINGS, 4)
    limit = ends("reference", begun)
    assert error(cenic_ends(robot, 1e-6, begun), limit).tenth < 0.01
    assert error(ends("reference", starts(FLIGHT, 4)), limit).median > 0.1


def test_a_motion_is_repeated_with_the_same_bits(robot: DrakeRobot) -> None:
    (start,) = starts(LANDINGS, 1)
    motion = CenicMotion(robot, start.q, start.v, 1e-4)
    found = []
    for _ in range(3):
        motion.restart()
        motion.advance(DURATION)
        found.append(motion.q)
    np.testing.assert_array_equal(found[1:], found[:-1])
