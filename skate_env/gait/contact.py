"""What the feet of a motion do: contact states, landing, normal forces, centre of pressure.

Functions return NaN, or an empty dictionary, for a motion without a complete step.
"""

from collections import Counter
from collections.abc import Callable, Sequence
from itertools import pairwise

import numpy as np
from numpy.typing import NDArray

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
# A foot with a smaller net normal force has no centre of pressure [body weights].
LOADED = 0.1
# The centre of pressure is outside a sole beyond this distance from its nearer end [m].
OUTSIDE = 1e-3
# A heel that lands first is lower than the toe by at least this [m].
_LOWER = 1e-4


def order_share(orders: list[StepOrder], standing_as_sliding: bool) -> float:
    """Share of steps whose contact states are exactly the paper's order."""
    return _mean([step.in_order(standing_as_sliding) for step in orders])


def dwell(motion: Motion) -> dict[str, float]:
    """Mean time in each visited state per step [ms]."""
    visited = sorted({state for step in motion.orders for state in step.dwell})
    return {
        str(state): 1e3 * _mean([step.dwell.get(state, 0.0) for step in motion.orders])
        for state in visited
    }


def time_in(motion: Motion, states: range) -> float:
    """Mean time in the given states per step [s]."""
    return _mean([sum(step.dwell.get(state, 0.0) for state in states) for step in motion.orders])


def share_in_air(motion: Motion) -> float:
    """Share of the time with the free foot in the air."""
    return time_in(motion, AIR) / motion.step_mean("period")


def last_states(motion: Motion) -> dict[str, float]:
    """Share of steps that end in each state, visits shorter than 2 ms left out."""
    count = Counter(sequence[-1] for step in motion.orders if (sequence := step.sequence()))
    return {str(state): count[state] / len(motion.orders) for state in sorted(count)}


def share_ending_in(motion: Motion, state: int) -> float:
    """Share of steps that end in a state; see `last_states`."""
    return last_states(motion).get(str(state), 0.0) if motion.orders else np.nan


def heel_first(motion: Motion) -> float:
    """Share of steps in which the free heel is lower than the toe at the last landing."""
    heel, toe = _landings(motion).T
    # False for NaN.
    return _mean(heel < toe - _LOWER)


def landing_toe(motion: Motion) -> float:
    """Smallest height of the free toe above the heel at the last landing of a step [mm]."""
    heel, toe = _landings(motion).T
    return 1e3 * float(np.min(toe - heel)) if toe.size else np.nan


def _landings(motion: Motion) -> Array:
    """Heights of the free heel and toe in the first sample after the last landing (steps, 2) [m].

    NaN for a step without a landing.
    """
    landings = [event[0] for event in motion.recording.events.tolist() if _lands(*event[2:4])]
    heights = np.full((len(motion.orders), 2), np.nan)
    for step, (begin, end) in enumerate(pairwise(motion.swaps)):
        within = [time for time in landings if begin < time < end]
        if within:
            at = np.searchsorted(motion.samples.t, within[-1])
            heights[step] = motion.samples.gaps[at, 1]
    return heights


def _lands(before: int, after: int) -> bool:
    return before in AIR and after in DOUBLE_SUPPORT


def normal_forces(motion: Motion) -> dict[str, Array]:
    """Compute the normal force of every end (T,) [body weights]; negative where it is pulled."""
    forces = motion.samples.contact_forces / motion.weight
    return {name: forces[:, foot, column] for name, (foot, column) in ENDS.items()}


def pull(motion: Motion, reduce: Callable[[Array], float]) -> dict[str, float]:
    """Mean or largest pull of every end in the complete steps [body weights]; 0 for a push."""
    shown = motion.shown
    if not shown.any():
        return {}
    forces = normal_forces(motion)
    return {end: float(reduce(np.maximum(-n[shown], 0.0))) for end, n in forces.items()}


def excess(motion: Motion) -> Array:
    """Distance of the centre of pressure from the sole (samples of the complete steps, 2) [m].

    Supporting and free foot; 0 within the sole, NaN for a foot with a net normal force below
    `LOADED`.
    """
    force = motion.samples.contact_forces[motion.shown][:, :, 2:] / motion.weight
    net = force.sum(axis=2)
    with np.errstate(divide="ignore", invalid="ignore"):
        # Share of the sole's length from the heel.
        place = force[:, :, 1] / net
    outside = sole(motion) * np.maximum(np.maximum(-place, place - 1.0), 0.0)
    return np.where(np.abs(net) < LOADED, np.nan, outside)


def outside_share(motion: Motion) -> float:
    """Share of the time with a centre of pressure outside a sole."""
    return _mean(np.any(excess(motion) > OUTSIDE, axis=1))


def largest_excess(motion: Motion) -> float:
    """Largest distance of a centre of pressure from the sole [mm]."""
    found = excess(motion)
    return 1e3 * float(np.nanmax(found)) if np.isfinite(found).any() else np.nan


def deepest_toe(motion: Motion) -> float:
    """Smallest height of the free toe [mm], negative below the ice."""
    return 1e3 * float(motion.steps["deepest_toe"].min()) if motion.steps.size else np.nan


def sole(motion: Motion) -> float:
    """Length of the sole [m]."""
    foot = motion.scene.get("body.foot")
    return float(foot["toe"] + foot["heel"])


def _mean(values: Sequence[float] | NDArray[np.bool_]) -> float:
    return float(np.mean(values)) if len(values) else np.nan
