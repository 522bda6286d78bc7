"""The benchmark of learners: its statistics, its results, and the page that shows them."""

from itertools import combinations
from pathlib import Path

import numpy as np
import pytest
from scipy import stats

from training.benchmark.__main__ import HEAD, RESULTS, interquartile_mean, interval, results, row

PAGE = Path(__file__).parents[1] / "docs" / "generated" / "benchmark.md"


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


def test_seeds_differ():
    for runs in results(RESULTS).values():
        assert len({run["seed"] for run in runs}) == len(runs)
        for left, right in combinations(runs, 2):
            assert left["return"] != right["return"], (left["seed"], right["seed"])


def test_the_page_shows_the_results():
    table = "\n".join([HEAD, *(row(runs) for runs in results(RESULTS).values())])
    assert table in PAGE.read_text(encoding="utf-8"), table
