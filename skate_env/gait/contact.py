"""What the feet of a motion do: contact states and normal forces.

Functions return NaN, or an empty dictionary, for a motion without a complete step.
"""

from collections import Counter
from collections.abc import Sequence

import numpy as np

from ..replay import Array
from .contact_sequence import StepOrder
from .motion import Motion

# Rows of Table 2: the free foot is in the air (0: both feet are); both feet touch the ice.
AIR, DOUBLE_SUPPORT = range(5), range(5, 21)
# Ends of both soles, as rows and columns of `Recording.contact_forces`.
ENDS = {
    "supporting heel": (0, 2),
    "supporting toe": (0, 3),
    "free heel": (1, 2),
    "free toe": (1, 3),
}


def mean(values: Sequence[float]) -> float:
    """Mean; NaN of no values."""
    return float(np.mean(values)) if len(values) else np.nan


def order_share(orders: list[StepOrder], standing_as_sliding: bool) -> float:
    """Share of steps whose contact states are exactly the paper's order."""
    return mean([step.in_order(standing_as_sliding) for step in orders])


def sequences(motion: Motion) -> dict[str, float]:
    """Share of the steps with each sequence of contact states, the most frequent first."""
    count = Counter("-".join(map(str, step.sequence())) for step in motion.orders)
    return {states: number / count.total() for states, number in count.most_common()}


def dwell(motion: Motion) -> dict[str, float]:
    """Mean time in each visited state per step [ms]."""
    visited = sorted({state for step in motion.orders for state in step.dwell})
    return {
        str(state): 1e3 * mean([step.dwell.get(state, 0.0) for step in motion.orders])
        for state in visited
    }


def time_in(motion: Motion, states: range) -> float:
    """Mean time in the given states per step [s]."""
    return mean([sum(step.dwell.get(state, 0.0) for state in states) for step in motion.orders])


def share_in_air(motion: Motion) -> float:
    """Share of the time with the free foot in the air."""
    return time_in(motion, AIR) / motion.step_mean("period")


def normal_forces(motion: Motion) -> dict[str, Array]:
    """Compute the normal force of every end (T,) [body weights]; negative where it is pulled."""
    forces = motion.recording.contact_forces / motion.weight
    return {name: forces[:, foot, column] for name, (foot, column) in ENDS.items()}


def largest_load(motion: Motion, sign: float) -> float:
    """Largest push (sign 1) or pull (-1) of the four ends [body weights]; 0 if there is none."""
    if not motion.shown.any():
        return np.nan
    loads = np.array([sign * force[motion.shown] for force in normal_forces(motion).values()])
    return max(0.0, float(loads.max()))


def deepest_toe(motion: Motion) -> float:
    """Smallest height of the free toe [mm], negative below the ice."""
    return 1e3 * float(motion.steps["deepest_toe"].min()) if motion.steps.size else np.nan
