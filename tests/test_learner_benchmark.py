"""The benchmark of learners: its evaluation, its statistics, its results, and their page."""

from itertools import combinations
from pathlib import Path

import gymnasium
import numpy as np
import pytest
from scipy import stats

from skate_env.registration import EPISODE, IDS
from training.benchmark.__main__ import (
    RESULTS,
    UNTRAINED,
    interquartile_mean,
    interval,
    results,
    short_table,
    table,
    untrained,
)
from training.benchmark.held_out import SEED, evaluate

ROOT = Path(__file__).parents[1]
PAGE = ROOT / "docs" / "generated" / "benchmark.md"


def test_the_interquartile_mean():
    """As SciPy's for multiples of four; between them values at the edges count in part."""
    values = np.random.default_rng(0).normal(size=(3, 12))
    expected = stats.trim_mean(values, 0.25, axis=1)
    np.testing.assert_allclose(interquartile_mean(values), expected, rtol=1e-14)
    assert interquartile_mean(np.array([9.0, 1.0, 4.0, 2.0, 0.0])) == pytest.approx(
        (0.75 * 1.0 + 2.0 + 0.75 * 4.0) / 2.5, rel=1e-15
    )


def test_the_interval():
    """It contains the mean, and has no width for equal values."""
    assert interval(np.full(5, 3.0)) == pytest.approx((3.0, 3.0, 3.0), rel=1e-15)
    mean, low, high = interval(np.arange(9.0))
    assert low < mean < high


@pytest.mark.parametrize("env_id", list(IDS)[1:])
def test_an_evaluation_is_that_of_single_environments(env_id):
    act, _ = untrained(env_id, "zero")
    found = evaluate(env_id, act, starts=4)
    total, steps, seconds, way = np.zeros((4, 4))
    env = gymnasium.make(env_id)
    for i in range(4):
        observation, info = env.reset(seed=SEED + i)
        begin, over = info["y_position"], False
        while not over:
            observation, reward, terminated, truncated, info = env.step(act(observation[None])[0])
            total[i] += reward
            over = terminated or truncated
        steps[i], seconds[i], way[i] = info["steps"], info["time"], info["y_position"] - begin
    assert seconds.max() < EPISODE
    for key, values in (("return", total), ("steps", steps), ("seconds", seconds)):
        assert found[key] == pytest.approx(values.mean(), rel=1e-12)
    assert found["distance"] == pytest.approx(way.mean(), rel=1e-12)
    assert found["goal"] == 0 and found["starts"] == 4


def test_seeds_differ():
    for (_, learner), runs in results(RESULTS).items():
        assert len({run["seed"] for run in runs}) == len(runs)
        assert learner not in UNTRAINED or len(runs) == 1
        for left, right in combinations(runs, 2):
            assert left["return"] != right["return"], (left["seed"], right["seed"])


def test_zero_actions_miss_the_threshold_and_the_shipped_policy_reaches_it():
    found = results(RESULTS)
    for env_id in IDS:
        zero, best = (found[env_id, name][0]["final"]["return"] for name in ("zero", "shipped"))
        threshold = gymnasium.spec(env_id).reward_threshold
        # Of the threshold: 30 % and less; 119, 196 and 119 %.
        assert zero < 0.6 * threshold and threshold <= best


def test_the_page_shows_the_results():
    shown = table(results(RESULTS))
    assert shown in PAGE.read_text(encoding="utf-8"), shown
    shown = short_table(results(RESULTS))
    assert shown in (ROOT / "README.md").read_text(encoding="utf-8"), shown
