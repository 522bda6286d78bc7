"""The contact states of a gait step, and the paper's order of them: 3-7-15-16-14-3."""

from bisect import bisect_left, bisect_right
from collections.abc import Sequence
from dataclasses import dataclass
from itertools import groupby, pairwise

# Rows of Table 2 between two swaps of the legs; the swap leads from 14 back to 3.
ORDER = (3, 7, 15, 16, 14)
# Shorter visits of a state do not count in `StepOrder.sequence` [s].
SHORTEST_VISIT = 2e-3
# The free foot touches with an end while the supporting one is flat; the free foot is flat.
_HEEL, _FLAT = (5, 7, 9, 11), range(13, 21)

# (time, what, state before, state after, supporting leg), as `Simulator.take_events` returns them.
Event = tuple[float, str, int, int, str]


@dataclass(frozen=True)
class StepOrder:
    """The contact states between two swaps of the legs.

    Attributes
    ----------
    visits
        Row of Table 2 and duration [s], one per event and in sequence; the durations sum to the
        period of the step.
    """

    visits: tuple[tuple[int, float], ...]

    @property
    def reached(self) -> int:
        """Number of states of `ORDER`, each after those before it, others between them allowed."""
        reached = 0
        for state, _ in self.visits:
            reached += reached < len(ORDER) and state == ORDER[reached]
        return reached

    @property
    def double(self) -> float:
        """Time of double support on heel or flat foot [s]."""
        return sum(time for state, time in self.visits if state in _HEEL or state in _FLAT)

    @property
    def other_time(self) -> float:
        """Time in states that are not of the order [s]."""
        return sum(time for state, time in self.visits if state not in ORDER)

    @property
    def dwell(self) -> dict[int, float]:
        """Time in each state that the step visits [s]; sums to the period."""
        total: dict[int, float] = {}
        for state, time in self.visits:
            total[state] = total.get(state, 0.0) + time
        return total

    def merged(self, standing_as_sliding: bool = False) -> list[tuple[int, float]]:
        """`visits` with consecutive ones of a state as one.

        With ``standing_as_sliding``, state 1 (the supporting foot sticks) counts as state 3 (it
        slides).
        """
        merged: list[tuple[int, float]] = []
        for state, time in self.visits:
            if standing_as_sliding and state == 1:
                state = 3
            if merged and merged[-1][0] == state:
                time += merged.pop()[1]
            merged.append((state, time))
        return merged

    def sequence(self, standing_as_sliding: bool = False) -> tuple[int, ...]:
        """States of `merged`, without visits shorter than `SHORTEST_VISIT`, without repetitions."""
        merged = self.merged(standing_as_sliding)
        states = [state for state, time in merged if time >= SHORTEST_VISIT]
        return tuple(state for state, _ in groupby(states))

    def in_order(self, standing_as_sliding: bool = False) -> bool:
        """Whether `sequence` is exactly `ORDER`."""
        return self.sequence(standing_as_sliding) == ORDER


def step_orders(events: Sequence[Event], swaps: Sequence[float]) -> list[StepOrder]:
    """Follow the contact state through every step between two swaps.

    Parameters
    ----------
    events
        All of them, oldest first.
    swaps
        Times of the swaps that end a step [s], oldest first.
    """
    times = [event[0] for event in events]
    steps = []
    for begin, end in pairwise(swaps):
        # The state in which a step begins counts, events of its last instant do not.
        first, last = max(bisect_right(times, begin) - 1, 0), bisect_left(times, end)
        since = [max(time, begin) for time in times[first:last]]
        states = [event[3] for event in events[first:last]]
        lasted = [b - a for a, b in pairwise([*since, end])]
        steps.append(StepOrder(tuple(zip(states, lasted, strict=True))))
    return steps
