"""Reward of progress through the paper's order of contact states while a policy learns."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from ..contact_sequence import ORDER

Array = NDArray[np.float64]

# Of heel and flat double support that a step in the paper's manner has at least [s].
DOUBLE = 0.03
# How long the states of the order pay in a step [s], and what it is worth to have come so far.
DWELL = np.array([0.0, 0.04, 0.04, 0.08, 0.15])
WORTH = np.array([0.0, 0.0, 0.1, 0.2, 0.4, 1.0])
# The front foot touches with an end while the rear one stands on its toe.
ON_ENDS = (6, 8)
# On one foot that is not flat and sliding, or on none.
STRAY = np.array([state in (0, 1, 2, 4) for state in range(21)])
# The rear toe, which has to stop between 16 and 14, has all of its speed [m/s].
SLIDING = 2.5
# The front foot, once both soles were flat, is close to the ice below this [m]; that pays for so
# long in a step [s].
HIGH, CLOSE = 0.05, 0.2
# Slide of a step whose order pays in full [m], and time in the air of one whose order does not [s].
FULL_SLIDE, ALOFT = 0.2, 0.1


@dataclass(frozen=True)
class Paid:
    """What pays, or costs, in an action of n environments; arrays (n,).

    Attributes
    ----------
    came
        Worth of the states reached by the action, less for time in the air.
    whole
        That of all states that the step reached, less for little slide, too.
    dwelt
        Time in states of the order [s].
    braked
        How far the rear toe has come to rest, as a part of `SLIDING`.
    close
        Time with the front foot close to the ice [s]: all of it on the ice, none of it at `HIGH`.
    strays
        1 in a state of `STRAY`.
    """

    came: Array
    whole: Array
    dwelt: Array
    braked: Array
    close: Array
    strays: Array


class Progress:
    """How far n environments have come in the order since their last step."""

    def __init__(self, n: int) -> None:
        self.reached = np.zeros(n, np.int64)
        """How many of its states."""
        self.dwelt = np.zeros((n, len(ORDER)))
        """How long in each of them [s]."""
        self.braked = np.zeros(n)
        """How far the rear toe has come to rest, from 0 to 1."""
        self.close = np.zeros(n)
        """How long the front foot has been close to the ice [s]."""
        self.aloft = np.zeros(n)
        """With both feet in the air [s]."""

    def follow(
        self,
        states: NDArray[np.int64],
        dt: Array,
        aloft: Array,
        slid: Array,
        slip: NDArray[np.float32],
        heights: NDArray[np.float32],
    ) -> Paid:
        """Follow an action and say what it came to.

        Parameters
        ----------
        states
            Contact states after it, (n,).
        dt, aloft
            How long it took, and of that both feet in the air (n,) [s].
        slid
            By the loaded foot since the last step (n,) [m].
        slip
            Speed of the supporting foot (n,) [m/s].
        heights
            Of the other foot's heel and toe (n, 2) [m].
        """
        worth = WORTH[self.reached]
        self.reached += np.array([*ORDER, -1])[self.reached] == states
        in_order = np.equal(ORDER, states[:, None])
        in_order &= np.arange(len(ORDER)) < self.reached[:, None]
        rolling = self.reached >= len(ORDER) - 1
        before = np.minimum(self.dwelt, DWELL)
        self.dwelt += dt[:, None] * in_order
        self.dwelt[:, -1] += 0.5 * dt * (rolling & np.isin(states, ON_ENDS))
        rest = np.clip(1.0 - np.abs(slip, dtype=np.float64) / SLIDING, 0.0, 1.0)
        braked = np.maximum(rest * in_order[:, 3:].any(axis=1) - self.braked, 0.0)
        self.braked += braked
        self.aloft += aloft
        grounded = np.clip(1.0 - self.aloft / ALOFT, 0.0, 1.0)
        whole = WORTH[self.reached] * np.clip(slid / FULL_SLIDE, 0.0, 1.0)
        low = 1.0 - np.abs(heights, dtype=np.float64).mean(axis=1) / HIGH
        low = np.maximum(low, 0.0) * dt * (self.reached >= 3)
        close = np.minimum(low, CLOSE - self.close)
        self.close += close
        return Paid(
            came=(WORTH[self.reached] - worth) * grounded,
            whole=whole * grounded,
            dwelt=(np.minimum(self.dwelt, DWELL) - before).sum(axis=1),
            braked=braked,
            close=close,
            strays=STRAY[states].astype(np.float64),
        )

    def begin(self, where: NDArray[np.bool_]) -> None:
        """Begin new steps."""
        for counted in vars(self).values():
            counted[where] = 0

    def replace(self, where: NDArray[np.bool_], others: "Progress") -> None:
        """Take over that of other episodes."""
        for name, mine in vars(self).items():
            mine[where] = vars(others)[name][where]
