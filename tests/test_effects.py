"""Scenes without effects, and parameters of an episode."""

import numpy as np
import pytest

from skate_env import EFFECTS, Simulator, load_scene, scene_names
from skate_env.studies.fixtures import BLADE


def run(sim: Simulator, steps: int = 30) -> tuple[np.ndarray, np.ndarray]:
    for _ in range(steps):
        sim.step()
    return sim.q, sim.v


@pytest.mark.parametrize("name", scene_names())
def test_effect_switched_twice_is_switched_back(name: str) -> None:
    scene = load_scene(name)
    switched = 0
    for effect, is_on in scene.effects().items():
        try:
            once = scene.without(effect) if is_on else scene.with_effect(effect)
        except ValueError as error:
            # The rest of the scene requires or excludes it; the message says why.
            assert "must be" in str(error), effect
            continue
        switched += 1
        assert once.effects()[effect] is not is_on
        twice = once.with_effect(effect) if is_on else once.without(effect)
        assert twice.effects()[effect] is is_on
        assert scene.effects()[effect] is is_on
    assert switched >= len(EFFECTS) - 5


def test_effects_are_described_in_the_scene_order() -> None:
    assert list(EFFECTS) == list(load_scene("paper").effects())
    assert all(EFFECTS.values())


def test_unknown_effect_is_refused_with_the_known_ones() -> None:
    for switch in (load_scene("paper").without, load_scene("paper").with_effect):
        with pytest.raises(ValueError, match='"wings": unknown; known are arms, head_joint'):
            switch("wings")


def test_locked_joints_are_no_coordinates() -> None:
    scene = load_scene("paper")
    whole = Simulator(scene)
    for joints in (("arms", 6), ("head_joint", 1), ("trunk_yaw", 1), ("trunk_roll", 1)):
        effect, count = joints
        sim = Simulator(scene.without(effect))
        assert len(sim.coordinate_names) == len(whole.coordinate_names) - count
        assert sim.size()["dof"] == whole.size()["dof"] - count
        assert sim.mass_matrix(np.zeros(len(sim.coordinate_names)))[0, 0] == pytest.approx(
            whole.mass_matrix(np.zeros(len(whole.coordinate_names)))[0, 0], rel=1e-12
        )


def test_absent_effects_leave_no_guards_and_no_rows() -> None:
    scene = load_scene("paper")
    bare = scene
    # Remaining guards: the sliding directions, capture, tensile force and wedging of the support.
    for effect in ("free_foot_contact", "impacts", "fall_detection", "foot_rotation"):
        bare = bare.without(effect)
    assert Simulator(bare).size()["rows"] == 0
    assert Simulator(bare).size()["guards"] == 6
    assert Simulator(bare.without("slipping")).size()["guards"] == 0
    assert Simulator(bare.without("directional_friction")).size()["guards"] == 0


def test_state_has_the_unknowns_of_table_2() -> None:
    """State 3 of `paper` slides: 16 joints and y0."""
    size = Simulator(load_scene("paper")).size()
    assert (size["accelerations"], size["multipliers"]) == (17, 0)


def test_scene_without_energy_balance() -> None:
    sim = Simulator(load_scene("paper").without("energy_balance"))
    with pytest.raises(ValueError, match="energy_balance = true"):
        sim.energy_balance()


# --- numbers -------------------------------------------------------------------------------


def test_every_number_has_a_value_within_its_range() -> None:
    for name in scene_names():
        for parameter, (value, low, high, unit) in load_scene(name).parameters().items():
            assert low <= value <= high, parameter
            assert unit, parameter


def test_numbers_are_changed_by_name() -> None:
    scene = load_scene("paper")
    other = scene.with_values({"ice.friction.mu_forward": 0.3, "control.lifting.K_p.2": 6000.0})
    assert other.parameters()["ice.friction.mu_forward"][0] == 0.3
    assert other.parameters()["control.lifting.K_p.2"][0] == 6000.0
    changed = {k for k, v in other.parameters().items() if v != scene.parameters()[k]}
    assert changed == {"ice.friction.mu_forward", "control.lifting.K_p.2"}


@pytest.mark.parametrize(
    ("values", "said"),
    [
        ({"ice.friction.mu_forward": -0.1}, "ice.friction.mu_forward = -0.1: must lie in"),
        ({"ice.friction.mu_forward": float("nan")}, "ice.friction.mu_forward"),
        ({"body.head.mass": float("inf")}, "body.head.mass"),
        ({"body.tail.mass": 1.0}, "body.tail.mass"),
        ({"control.arm_swing.amplitude": 1.0}, "control.arm_swing.amplitude"),
        ({"name": 1.0}, "name"),
        ({"": 1.0}, "no number of that name"),
    ],
)
def test_an_invalid_parameter_is_refused_without_a_change(values, said) -> None:
    sim = Simulator(load_scene("paper"))
    sim.step()
    before = sim.snapshot()
    with pytest.raises(ValueError, match=r"must|not finite|no number") as refusal:
        sim.reset(params=values)
    assert said in str(refusal.value)
    assert sim.snapshot() == before


def test_params_last_for_one_episode() -> None:
    sim = Simulator(load_scene("paper"))
    own = run(sim)
    params = {"ice.gravity": 9.7, "body.upper_body.mass": 22.0, "ice.friction.mu_forward": 0.25}
    sim.reset(params=params)
    assert {name: sim.scene.parameters()[name][0] for name in params} == params
    other = run(sim)
    assert not np.array_equal(own[0], other[0])
    # The same as a scene with these parameters.
    scene = Simulator(load_scene("paper").with_values(params))
    assert np.array_equal(other, run(scene))
    sim.reset()
    assert np.array_equal(own, run(sim))


def test_snapshot_holds_the_params() -> None:
    sim = Simulator(load_scene("paper"))
    sim.reset(params={"control.lifting.ahead": 0.7})
    run(sim, 10)
    saved = sim.snapshot()
    fresh = Simulator(load_scene("paper"))
    fresh.restore(saved)
    assert fresh.scene.parameters() == sim.scene.parameters()
    assert np.array_equal(run(sim), run(fresh))


@pytest.mark.parametrize("effect", ["hip_pd", "free_knee_pd", "viscous_friction", "edge_damping"])
def test_snapshot_of_another_scene_is_refused(effect: str) -> None:
    """Some of these scenes have equally many coordinates and parameters."""
    sim = Simulator(load_scene("paper").with_effect("hip_pd"))
    before = sim.snapshot()
    saved = Simulator(load_scene("paper").with_effect(effect)).snapshot()
    if effect == "hip_pd":
        sim.restore(saved)
    else:
        with pytest.raises(ValueError, match="differ in more than their numbers"):
            sim.restore(saved)
    assert sim.snapshot() == before


def test_length_that_puts_a_foot_below_the_ice_is_refused() -> None:
    sim = Simulator(load_scene(BLADE))
    before = sim.scene.to_json()
    with pytest.raises(ValueError, match=r"free toe starts .* below the ice"):
        sim.reset(params={"body.foot.toe": 0.6})
    assert sim.scene.to_json() == before
