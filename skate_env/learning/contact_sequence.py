"""Reward of progress through the paper's order of contact states while a policy learns."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from ..contact_sequence import ORDER

Array = NDArray[np.float64]

# Minimum duration of heel and flat double support in a step of the paper's kind [s].
DOUBLE = 0.03

# Parameters of the training reward.
# Longest rewarded time in each state of the order per gait step [s]; value of the states reached.
DWELL_LIMITS = np.array([0.0, 0.04, 0.04, 0.08, 0.15])
VALUES = np.array([0.0, 0.0, 0.1, 0.2, 0.4, 1.0])
# Front foot on one sole end, rear foot on its toe.
ON_ENDS = (6, 8)
# Flight, or single support without a flat sliding foot.
STRAY = np.array([state in (0, 1, 2, 4) for state in range(21)])
# Speed of the rear toe at which its braking begins [m/s]; it stops between states 16 and 14.
SLIDING = 2.5
# Height below which the front foot is close to the ice after flat double support [m], and longest
# rewarded time per gait step [s].
HIGH, CLOSE = 0.05, 0.2
# Slide with the full reward of the order [m], and flight time without a reward of the order [s].
FULL_SLIDE, MAX_FLIGHT = 0.2, 0.1


@dataclass(frozen=True)
class SequenceTerms:
    """Reward terms of the sequence for an action of n environments; arrays (n,).

    Attributes
    ----------
    reached
        Value of the states reached by the action, reduced by flight time.
    total
        Value of all states reached in the step, reduced by flight time and a short slide.
    dwell
        Rewarded time in states of the order [s].
    brake
        Deceleration of the rear toe as a fraction of `SLIDING`.
    close
        Rewarded time with the front foot close to the ice [s]: weight 1 on the ice, 0 at `HIGH`.
    stray
        1 in a state of `STRAY`.
    """

    reached: Array
    total: Array
    dwell: Array
    brake: Array
    close: Array
    stray: Array


class Progress:
    """Progress of n environments in the order since their last leg swap."""

    def __init__(self, n: int) -> None:
        self.reached = np.zeros(n, np.int64)
        """Number of states reached."""
        self.dwell_time = np.zeros((n, len(ORDER)))
        """Time in each of them [s]."""
        self.braking = np.zeros(n)
        """Deceleration of the rear toe, from 0 to 1 at rest."""
        self.close_time = np.zeros(n)
        """Rewarded time with the front foot close to the ice [s]."""
        self.flight_time = np.zeros(n)
        """Flight time [s]."""

    def update(
        self,
        states: NDArray[np.int64],
        dt: Array,
        flight: Array,
        slide: Array,
        slip: NDArray[np.float32],
        heights: NDArray[np.float32],
    ) -> SequenceTerms:
        """Update the progress with an action and return its reward terms.

        Parameters
        ----------
        states
            Contact states after the action (n,).
        dt, flight
            Duration of the action and flight time in it (n,) [s].
        slide
            Slide of the loaded foot since the last leg swap (n,) [m].
        slip
            Speed of the supporting foot (n,) [m/s].
        heights
            Heights of the other foot's heel and toe (n, 2) [m].
        """
        value = VALUES[self.reached]
        self.reached += np.array([*ORDER, -1])[self.reached] == states
        in_order = np.equal(ORDER, states[:, None])
        in_order &= np.arange(len(ORDER)) < self.reached[:, None]
        rolling = self.reached >= len(ORDER) - 1
        before = np.minimum(self.dwell_time, DWELL_LIMITS)
        self.dwell_time += dt[:, None] * in_order
        self.dwell_time[:, -1] += 0.5 * dt * (rolling & np.isin(states, ON_ENDS))
        rest = np.clip(1.0 - np.abs(slip, dtype=np.float64) / SLIDING, 0.0, 1.0)
        brake = np.maximum(rest * in_order[:, 3:].any(axis=1) - self.braking, 0.0)
        self.braking += brake
        self.flight_time += flight
        contact = np.clip(1.0 - self.flight_time / MAX_FLIGHT, 0.0, 1.0)
        total = VALUES[self.reached] * np.clip(slide / FULL_SLIDE, 0.0, 1.0)
        low = 1.0 - np.abs(heights, dtype=np.float64).mean(axis=1) / HIGH
        low = np.maximum(low, 0.0) * dt * (self.reached >= 3)
        close = np.minimum(low, CLOSE - self.close_time)
        self.close_time += close
        return SequenceTerms(
            reached=(VALUES[self.reached] - value) * contact,
            total=total * contact,
            dwell=(np.minimum(self.dwell_time, DWELL_LIMITS) - before).sum(axis=1),
            brake=brake,
            close=close,
            stray=STRAY[states].astype(np.float64),
        )

    def reset(self, where: NDArray[np.bool_]) -> None:
        """Reset the progress of environments at a leg swap."""
        for values in vars(self).values():
            values[where] = 0

    def replace(self, where: NDArray[np.bool_], others: "Progress") -> None:
        """Copy the progress of other episodes."""
        for name, mine in vars(self).items():
            mine[where] = vars(others)[name][where]
