"""The contents of recordings agree with the simulator."""

import csv
from dataclasses import fields
from itertools import pairwise

import gymnasium
import numpy as np
import pytest

from skate_env import Simulator, load_scene
from skate_env.replay import TAU8, Recording, figures, record, recorder
from skate_env.replay.recording import STEP_UNITS
from skate_env.scenes import replace

STEPS = 3
# Lengths of the links that are drawn to scale, Table 1 [m], by row of `segments`.
LENGTHS = {1: 0.40, 2: 0.38, 3: 0.27, 4: 0.38, 5: 0.40, 7: 0.1, 8: 0.1, 9: 0.41, 16: 0.24} | {
    first + i: length for first in (10, 13) for i, length in enumerate((0.31, 0.24, 0.18))
}


@pytest.fixture(scope="module")
def skated() -> Recording:
    return record(Simulator("paper"), STEPS)


def test_recording_ends_with_the_last_step(skated):
    assert len(skated.steps) == STEPS
    assert skated.metadata["termination"] is None
    last = skated.steps["time"][-1]
    assert skated.t[-2] < last <= skated.t[-1]


@pytest.mark.parametrize("name", ["paper", "push_only"])
def test_a_recording_with_a_policy_is_its_walk_in_the_environment(name, random_policy):
    policy = random_policy(name, size=0.2)
    skated = record(Simulator(policy.scene), STEPS, policy=policy)
    assert skated.metadata["policy"] == policy.about
    env = gymnasium.make("IceSkate-v0", perturb=0.0, **policy.environment())
    seen, _ = env.reset(seed=0)
    for row in range(len(skated.t)):
        sim = env.unwrapped.simulator
        for mine, other in ((skated.t, sim.time), (skated.q, sim.q), (skated.v, sim.v)):
            np.testing.assert_array_equal(mine[row], other)
        if row + 1 < len(skated.t):
            seen, *_ = env.step(policy.predict(seen)[0])
    # It differs from the baseline's.
    alone = record(Simulator(policy.scene), STEPS)
    assert alone.metadata["policy"] is None
    assert not np.array_equal(alone.q[50], skated.q[50])


def test_samples_are_every_action_period_from_zero(skated):
    period = Simulator("paper").action_period
    assert skated.t[0] == 0.0
    np.testing.assert_allclose(np.diff(skated.t), period, rtol=1e-9)
    sparse = record(Simulator("paper"), 1, every=5)
    np.testing.assert_array_equal(sparse.q, skated.q[: 5 * len(sparse.t) : 5])


def test_periods_add_up_to_the_time_of_the_last_swap(skated):
    times = skated.steps["time"]
    assert skated.steps["period"].sum() == pytest.approx(times[-1], rel=1e-12)
    assert np.all(np.diff(times) > 0.0)
    np.testing.assert_array_equal(skated.events["time"][skated.swaps()], times)


def test_legs_alternate_over_the_steps(skated):
    for before, after in pairwise(skated.steps["time"]):
        inside = (skated.t > before) & (skated.t < after)
        assert len(set(skated.right_support[inside].tolist())) == 1
    swaps = np.flatnonzero(np.diff(skated.right_support.astype(int)))
    assert len(swaps) == STEPS


def test_velocity_is_the_rate_of_the_coordinates_between_events(skated):
    quiet = np.ones(len(skated.t) - 1, dtype=bool)
    for time in skated.events["time"]:
        quiet &= ~((skated.t[:-1] <= time) & (time <= skated.t[1:]))
    dt = np.diff(skated.t)[:, None]
    mean = 0.5 * (skated.v[1:] + skated.v[:-1])
    error = np.abs(np.diff(skated.q, axis=0) / dt - mean)[quiet]
    # The error of the trapezoidal rule depends on the third derivative and is small.
    assert np.median(error) < 0.01 * np.abs(skated.v).max()


def test_links_keep_the_lengths_of_table_1(skated):
    lengths = np.linalg.norm(np.diff(skated.segments, axis=2)[:, :, 0], axis=-1)
    for link, length in LENGTHS.items():
        np.testing.assert_allclose(lengths[:, link], length, atol=1e-5, err_msg=str(link))


def test_links_are_connected(skated):
    ends = skated.segments
    joined = [(1, 2), (4, 5), (7, 8), (8, 9), (10, 11), (11, 12), (13, 14), (14, 15), (9, 16)]
    for link, following in joined:
        np.testing.assert_allclose(ends[:, link, 1], ends[:, following, 0], atol=1e-5)
    np.testing.assert_allclose(ends[:, 16, 1], skated.head, atol=1e-5)


def test_flat_support_has_its_sole_on_the_ice(skated):
    # In the odd states of Table 2 the support is flat.
    flat = skated.state_number % 2 == 1
    assert flat.any()
    np.testing.assert_allclose(skated.segments[flat, 0, :, 2], 0.0, atol=1e-6)


def test_state_sequence_runs_from_swap_to_swap_without_repeats(skated):
    sequence = skated.state_sequence()
    assert all(a != b for a, b in pairwise(sequence))
    start, end = skated.steps["time"][-2:]
    inside = (skated.t > start) & (skated.t < end)
    assert set(skated.state_number[inside].tolist()) <= set(sequence)


def test_saved_recording_reads_back_unchanged(skated, tmp_path):
    skated.save(tmp_path / "r.npz")
    again = Recording.load(tmp_path / "r.npz")
    for field in fields(Recording):
        before, after = getattr(skated, field.name), getattr(again, field.name)
        if field.name == "metadata":
            assert before == after
        else:
            np.testing.assert_array_equal(before, after)
            assert before.dtype == after.dtype
    assert again.scene.to_json() == load_scene("paper").to_json()


def test_table_of_steps_has_the_recorded_numbers(skated, tmp_path):
    skated.save_steps(tmp_path / "steps.csv")
    with (tmp_path / "steps.csv").open(newline="", encoding="utf-8") as file:
        header, *rows = csv.reader(file)
    assert header == ["step", *(f"{name} [{unit}]" for name, unit in STEP_UNITS.items())]
    assert [int(row[0]) for row in rows] == [1, 2, 3]
    for column, name in enumerate(STEP_UNITS, start=1):
        assert [float(row[column]) for row in rows] == skated.steps[name].tolist()


def test_progress_counts_every_step():
    counted = []
    record(Simulator("paper"), STEPS, progress=counted.append)
    assert sum(counted) == STEPS


def test_fall_ends_the_recording_and_is_its_cause():
    fallen = record(Simulator(replace(load_scene("paper"), {"fall.head_height": 2.9})), STEPS)
    assert fallen.metadata["termination"] == "fall"
    assert len(fallen.steps) == 0 and fallen.state_sequence() == []


def test_a_robot_without_steps_ends_the_recording(monkeypatch):
    monkeypatch.setattr(recorder, "LONGEST_STEP", 0.03)
    waited = record(Simulator("paper"), STEPS)
    assert waited.metadata["termination"] == "no_step"
    assert waited.t[-1] < 0.06


def test_interference_torque_is_the_matrix_times_the_acceleration():
    swung = record(Simulator(replace(load_scene("paper"), TAU8)), 1)
    torque = figures.yaw_on_shoulder(swung)
    sim = Simulator(swung.scene)
    for i in (0, len(swung.t) // 2, len(swung.t) - 1):
        # The yaw acceleration alone, through the whole matrix.
        alone = np.zeros(swung.q.shape[1])
        alone[swung.index("q8")] = swung.acceleration[i, swung.index("q8")]
        assert torque[i] == (sim.mass_matrix(swung.q[i]) @ alone)[swung.index("q11")]


def test_arms_that_are_locked_have_no_correlation():
    names = ["q8", "q11", "q12", "q13", "q14", "q15", "q16"]
    # Without arms the gait may fail; a fraction of a step suffices.
    scene = replace(load_scene("paper"), {f"start.{x}.{n}": 0.0 for x in "qv" for n in names})
    locked = record(Simulator(replace(scene, {"locked": names, "fall.head_height": 2.9})), 1)
    assert locked.index("q11") is None
    assert figures.shoulder_correlation(locked) is None
    assert not figures.yaw_on_shoulder(locked).any()
