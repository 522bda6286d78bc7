"""Cost of environment steps as a function of their error. Timings are not asserted."""

import numpy as np
import pytest

from skate_env import Simulator, load_scene
from tests.bench import equal_steps, located_steps, sizes
from tests.bench.environments import MOREAU, SCENES
from tests.bench.mujoco_env import MujocoSkateEnv
from tests.bench.table import OURS, Error, Group, Row

MADE = {
    (OURS, f"{OURS}, fast"): (1e-2, 2e-6),
    (OURS, f"{OURS}, moreau 2.5 ms"): (1e-4, 8e-6),
    ("MuJoCo 4", "MuJoCo, Euler, 2.5 ms"): (1e-1, 3e-5),
    ("MuJoCo 4", "MuJoCo, Euler, 0.05 ms"): (1e-3, 3e-3),
    ("MuJoCo 4", "MuJoCo, RK4, 1.25 ms"): (1e-2, 2e-4),
}


@pytest.fixture
def group() -> Group:
    rows = [
        Row(equal_steps.case_of("paper"), label, tool, "", time=time, error=Error(off, off))
        for (tool, label), (off, time) in MADE.items()
    ]
    return Group("", "", 2, rows)


@pytest.mark.parametrize("scene", SCENES)
def test_our_errors_fall_with_the_step(scene: str) -> None:
    limit = equal_steps.ends(scene, "reference")
    coarse, long, short, shorter = MOREAU
    order = [coarse, long, "fast", short, shorter, "balanced"]
    found = [equal_steps.error(equal_steps.ends(scene, name), limit) for name in order]
    medians = [error.median for error in found]
    assert medians == sorted(medians, reverse=True)
    # At most 2.8e-6 rad.
    assert found[-1].tenth < 1e-5


def test_mujoco_errors_fall_with_its_step() -> None:
    def ends(step: float) -> equal_steps.Array:
        return equal_steps.mujoco_ends(MujocoSkateEnv(load_scene("paper"), step), "paper")

    limit = ends(1e-4)
    medians = [equal_steps.error(ends(step), limit).median for step in (5e-3, 2.5e-3, 6.25e-4)]
    assert medians == sorted(medians, reverse=True) and medians[-1] > 0.0
    assert equal_steps.error(limit, limit) == Error(0.0, 0.0)


def test_both_have_the_same_starts_and_torques(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    monkeypatch.setattr(equal_steps, "_ACTIONS", 1)
    ours = equal_steps.ends("paper", "balanced")
    theirs = equal_steps.mujoco_ends(MujocoSkateEnv(load_scene("paper"), 1e-4), "paper")
    # The simulator's foot is flat on the ice. The controller's torques are the same for all starts.
    angles = slice(1, None)
    same = [
        np.corrcoef(own, other)[0, 1]
        for own, other in zip(ours.T[angles], theirs.T[angles], strict=True)
    ]
    # 0.9986; with other actions 0.05.
    assert np.median(same) > 0.99, same


def test_motions_that_cannot_be_compared_count_as_lost() -> None:
    limit = np.zeros((10, 3))
    found = limit.copy()
    found[0] = np.inf
    found[1:3, 1] = 0.5, -0.25
    error = equal_steps.error(found, limit)
    assert error == Error(0.0, np.inf)
    # Starts at which the reference solution fails are not simulated by the others.
    limit[0] = np.inf
    assert equal_steps.error(found, limit) == Error(0.0, 0.5)


def test_cost_is_interpolated_between_settings(group: Group) -> None:
    case, other = equal_steps.case_of("paper"), equal_steps.case_of("push_only")
    at = [equal_steps.cost(group, case, True, error) for error in (1.0, 1e-2, 1e-3, 1e-4, 1e-5)]
    assert at == [pytest.approx(2e-6)] * 2 + [pytest.approx(4e-6), pytest.approx(8e-6), None]
    # Among MuJoCo's integrators the cheaper one counts; there is no interpolation between them.
    assert equal_steps.cost(group, case, False, 1e-2) == pytest.approx(2e-4)
    assert equal_steps.cost(group, case, False, 1e-3) == pytest.approx(3e-3)
    between = equal_steps.cost(group, case, False, 10**-2.5)
    assert between == pytest.approx(3e-5 * (3e-3 / 3e-5) ** 0.75)
    assert equal_steps.cost(group, other, True, 1e-2) is None
    ours, theirs = equal_steps.USUAL
    assert equal_steps.median_error(group, case, ours) == 1e-2
    assert equal_steps.median_error(group, case, theirs) == 1e-1
    assert equal_steps.median_error(group, other, theirs) is None


def test_methods_follow_from_labels(group: Group) -> None:
    named = [equal_steps.STEPPED] * 2 + [equal_steps.EULER] * 2 + [equal_steps.RK4]
    assert [equal_steps.method_of(row) for row in group.rows] == named
    (balanced, reference), cenic = (
        [equal_steps.method_of(Row("", f"{start}, {end}", "", "")) for end in settings]
        for start, settings in ((OURS, ("balanced", "reference")), ("CENIC", ("1e-3", "1e-4")))
    )
    assert balanced == reference == equal_steps.BALANCED and set(cenic) == {equal_steps.CENIC}


def test_note_compares_at_equal_errors(group: Group) -> None:
    (note,) = equal_steps.ratio_notes(group, "MuJoCo", equal_steps.USUAL)
    assert "paper, by error: 100 at the error of IceSkate, fast; " in note
    assert note.endswith("15 at the error of MuJoCo, Euler, 2.5 ms.")
    assert equal_steps.ratio_notes(group, "MuJoCo", ["another setting"]) == []


def test_no_motion_is_lost() -> None:
    for case in (located_steps.LANDINGS, located_steps.FLIGHT):
        begun = located_steps.starts(case, sizes.full().landings)
        limit = located_steps.ends("reference", begun)
        coarse, fine = (
            equal_steps.error(located_steps.ends(name, begun), limit)
            for name in ("fast", "balanced")
        )
        # 2.3e-3 and 6e-7 rad.
        assert fine.tenth < 5e-6 < coarse.median <= coarse.tenth < 0.01


def test_angles_after_a_leg_swap_are_those_of_the_same_posture() -> None:
    scene = located_steps.scene()
    for start in located_steps.starts(located_steps.FLIGHT, 5):
        right, left = Simulator(scene), Simulator(scene)
        right.reset(start.q, start.v, "right")
        segments = right.link_segments()
        toe = segments[6, 1, 1:]
        left.reset(np.array([*toe, *located_steps.angles(right, "left")]), start.v, "left")
        found = left.link_segments()
        # The links of the legs begin at their other end; soles and waist have the same direction.
        legs = found[6::-1, ::-1].copy()
        legs[::3] = found[6::-3]
        np.testing.assert_allclose(legs, segments[:7], atol=1e-14)
        np.testing.assert_allclose(found[7:], segments[7:], atol=1e-14)
        np.testing.assert_array_equal(located_steps.angles(right, "right"), start.q[2:])
