"""What a motion costs: time of all settings in turn, and instructions."""

import math
import random
from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np

from .. import callgrind
from ..timing import Block
from .cases import Case
from .settings import Setting

# A block that takes longer than this [s] takes its turn less often, but so often at least.
_SHORT, _FEWEST = 2e-3, 20


@dataclass(frozen=True)
class Times:
    """The least time of every block, and how sure that is."""

    least: list[float]
    """[s]"""
    error: float
    """Largest relative disagreement between both halves of the rounds."""


def interleaved(blocks: Sequence[Block], rounds: int, progress: Callable[[], object]) -> Times:
    """Time every block in turn, in a new order each round; long ones not in every round."""
    first = [1e-9 * block() for block in blocks]
    most = max(1, rounds // _FEWEST)
    every = [min(most, max(1, math.ceil(time / _SHORT))) for time in first]
    halves = np.full((len(blocks), 2), np.inf)
    order = list(range(len(blocks)))
    shuffle = random.Random(0).shuffle
    for i in range(rounds):
        shuffle(order)
        for k in order:
            if i % every[k] == 0:
                half = int(2 * i >= rounds)
                halves[k, half] = min(halves[k, half], 1e-9 * blocks[k]())
        progress()
    least = halves.min(axis=1)
    known = np.isfinite(halves).all(axis=1)
    spread = halves[known].max(axis=1) / least[known] - 1.0
    return Times(least.tolist(), float(spread.max(initial=0.0)))


def instructions(
    case: Case, settings: Sequence[Setting], progress: Callable[[], object]
) -> list[float]:
    """Count the instructions per simulated second of each setting.

    Raises
    ------
    callgrind.Unavailable
        If valgrind is not installed, or cannot follow the engine.
    """
    torque = None if case.torque is None else case.torque.tolist()
    runs = [
        callgrind.Run(case.with_accuracy(setting.accuracy), case.duration, torque)
        for setting in settings
    ]
    return [each.instructions / case.duration for each in callgrind.count(runs, progress)]
