"""Interquartile means with intervals: Agarwal et al. 2021, arXiv:2108.13264, section 4.3."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.stats import trim_mean

Array = NDArray[np.float64]

RESAMPLES = 2000


@dataclass(frozen=True)
class Estimate:
    """An interquartile mean, and the bounds of its 95 % bootstrap interval."""

    mean: float
    low: float
    high: float


def interquartile_mean(scores: Array, seed: int = 0) -> Estimate:
    """Return the mean of the middle half of all scores; resampling is stratified by start.

    Parameters
    ----------
    scores
        (training seeds, episodes); NaN where nothing was measured. Training seeds are resampled
        with replacement separately for each start; with one seed the starts are resampled.
    """
    known = ~np.isnan(scores).any(axis=0)
    scores = scores[:, known]
    if scores.size == 0:
        return Estimate(np.nan, np.nan, np.nan)
    rng = np.random.default_rng(seed)
    seeds, starts = scores.shape
    if seeds > 1:
        drawn = rng.integers(seeds, size=(RESAMPLES, seeds, starts))
        samples = np.take_along_axis(scores[None], drawn, axis=1)
    else:
        samples = scores[0, rng.integers(starts, size=(RESAMPLES, starts))]
    means = trim_mean(samples.reshape(RESAMPLES, -1), 0.25, axis=1)
    low, high = np.percentile(means, [2.5, 97.5])
    return Estimate(float(trim_mean(scores, 0.25, axis=None)), float(low), float(high))
