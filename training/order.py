"""The paper's order of contact states in a step: 3-7-15-16-14, then the legs swap."""

from collections.abc import Sequence
from dataclasses import dataclass
from itertools import pairwise

import numpy as np

# Rows of Table 2.
ORDER = np.array([3, 7, 15, 16, 14])
# The front foot touches with an end, the other one flat; the front foot is flat.
HEEL, FLAT = (5, 7, 9, 11), range(13, 21)
# Of heel and flat double support that a step in the paper's manner has at least [s].
DOUBLE = 0.03

# (time, what, state before, state after, supporting leg), as `Simulator.take_events` returns them.
Event = tuple[float, str, int, int, str]


@dataclass(frozen=True)
class StepOrder:
    """What came of the order between two swaps of the legs.

    Attributes
    ----------
    reached
        How many states of `ORDER`, each after those before it, others between them allowed.
    double
        Time of double support on heel or flat foot [s].
    aside
        Time in states that are not of the order [s].
    """

    reached: int
    double: float
    aside: float


def step_orders(events: Sequence[Event], swaps: Sequence[float]) -> list[StepOrder]:
    """Follow the order through every step between two swaps.

    Parameters
    ----------
    events
        All of them, oldest first.
    swaps
        When the load passed to the other leg [s], oldest first.
    """
    return [_step(events, begin, end) for begin, end in pairwise(swaps)]


def _step(events: Sequence[Event], begin: float, end: float) -> StepOrder:
    reached, double, aside = 0, 0.0, 0.0
    ends = [event[0] for event in events[1:]] + [np.inf]
    for (since, _, _, state, _), until in zip(events, ends, strict=True):
        # The state in which a step begins counts, events of its last instant do not.
        if until <= begin or since >= end:
            continue
        lasted = min(until, end) - max(since, begin)
        double += lasted * (state in HEEL or state in FLAT)
        aside += lasted * (state not in ORDER)
        reached += reached < len(ORDER) and state == ORDER[reached]
    return StepOrder(reached, double, aside)
