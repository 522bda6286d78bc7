"""What the limits of a gait are about: landing, centre of pressure, lift, work, body.

Functions return NaN, or an empty dictionary, for a motion without a complete step.
"""

from collections import Counter
from collections.abc import Callable
from itertools import pairwise

import numpy as np

from skate_env._core import Simulator
from skate_env.gait import Motion
from skate_env.gait.contact import AIR, DOUBLE_SUPPORT, mean
from skate_env.replay import Array

# A foot with a smaller net normal force has no centre of pressure [body weights].
LOADED = 0.1
# The centre of pressure is outside a sole beyond this distance from its nearer end [m].
OUTSIDE = 1e-3
# A heel that lands first is lower than the toe by at least this [m].
_LOWER = 1e-4
# Rows of `Simulator.link_segments`: lower leg, free foot, head.
_LOWER_LEG, _FREE_FOOT, _HEAD = 1, 6, 16
# Sides of a step of the difference quotient that gives the head's velocity [s].
_STEP = 1e-6


def share_ending_in(motion: Motion, state: int) -> float:
    """Share of steps that end in a state, visits shorter than 2 ms left out."""
    if not motion.orders:
        return np.nan
    count = Counter(sequence[-1] for step in motion.orders if (sequence := step.sequence()))
    return count[state] / len(motion.orders)


def heel_first(motion: Motion) -> float:
    """Share of steps in which the free heel is lower than the toe at the last landing."""
    heel, toe = _landings(motion).T
    # False for NaN.
    return mean((heel < toe - _LOWER).tolist())


def landing_toe(motion: Motion) -> float:
    """Smallest height of the free toe above the heel at the last landing of a step [mm]."""
    heel, toe = _landings(motion).T
    return 1e3 * float(np.min(toe - heel)) if toe.size else np.nan


def _landings(motion: Motion) -> Array:
    """Heights of the free heel and toe in the first sample after the last landing (steps, 2) [m].

    NaN for a step without a landing.
    """
    recording = motion.recording
    events = recording.events.tolist()
    landings = [time for time, _, *states, _ in events if _lands(*states)]
    heights = np.full((len(motion.orders), 2), np.nan)
    for step, (begin, end) in enumerate(pairwise(motion.swaps)):
        within = [time for time in landings if begin < time < end]
        if within:
            at = np.searchsorted(recording.t, within[-1])
            heights[step] = recording.segments[at, _FREE_FOOT, :, 2]
    return heights


def _lands(before: int, after: int) -> bool:
    return before in AIR and after in DOUBLE_SUPPORT


def excess(motion: Motion) -> Array:
    """Distance of the centre of pressure from the sole (samples of the complete steps, 2) [m].

    Supporting and free foot; 0 within the sole, NaN for a foot with a net normal force below
    `LOADED`.
    """
    force = motion.recording.contact_forces[motion.shown][:, :, 2:] / motion.weight
    net = force.sum(axis=2)
    with np.errstate(divide="ignore", invalid="ignore"):
        # Share of the sole's length from the heel.
        place = force[:, :, 1] / net
    outside = sole(motion) * np.maximum(np.maximum(-place, place - 1.0), 0.0)
    return np.where(np.abs(net) < LOADED, np.nan, outside)


def outside_share(motion: Motion) -> float:
    """Share of the time with a centre of pressure outside a sole."""
    return mean(np.any(excess(motion) > OUTSIDE, axis=1).tolist())


def knees_backward(motion: Motion) -> float:
    """Largest angle by which a knee bends backward [rad]."""
    bent = [
        sign * motion.recording.q[motion.shown, column]
        for name, sign in (("q3", -1.0), ("q6", 1.0))
        if (column := motion.recording.index(name)) is not None
    ]
    return max(0.0, float(np.max(bent))) if bent and motion.shown.any() else np.nan


def lift(motion: Motion) -> Array:
    """Vertical force of lifting and head damping in the complete steps [body weights].

    Zero with both feet in the air, where the controller exerts none.
    """
    recording, shown = motion.recording, motion.shown
    force = np.zeros(np.count_nonzero(shown))
    if lifting := motion.scene.get("control.lifting"):
        top, neck = recording.head[shown, 2], recording.segments[shown, _HEAD, 0, 2]
        psi = top + (1.0 - motion.scene.get("control.psi")) * (neck - top)
        force += lifting["K_p"][2] * (lifting["height"] - psi)
    damping = motion.scene.get("stabilizers.head_damping")
    if damping and damping["z"] != 0.0:
        force -= damping["z"] * _head_rate(motion)
    return np.where(recording.state_number[shown] == 0, 0.0, force) / motion.weight


def _head_rate(motion: Motion) -> Array:
    """Vertical velocity of the head relative to the supporting ankle (shown,) [m/s]."""
    sim = Simulator(motion.scene)
    q, v = motion.recording.q[motion.shown], motion.recording.v[motion.shown]
    heights = [[_head_height(sim, x) for x in q + side * _STEP * v] for side in (-1.0, 1.0)]
    rate: Array = np.diff(np.array(heights), axis=0)[0] / (2.0 * _STEP)
    return rate


def _head_height(sim: Simulator, q: Array) -> float:
    segments = sim.link_segments(q)
    return float(segments[_HEAD, 1, 2] - segments[_LOWER_LEG, 0, 2])


def lift_over(motion: Motion, reduce: Callable[[Array], float]) -> float:
    """Mean or largest `lift` [body weights]."""
    return float(reduce(lift(motion))) if motion.shown.any() else np.nan


def work_of_tau1(motion: Motion) -> float:
    """Mean work of tau1, the couple on the supporting foot, per step [J].

    Neither lifting nor a policy acts on q1.
    """
    recording = motion.recording
    column = recording.index("q1")
    if column is None or not motion.orders:
        return np.nan
    power = recording.torque[:, column] * recording.v[:, column]
    # The couple and its power begin and end with states, so a sample holds for its period.
    work = power[:-1] * np.diff(recording.t)
    return float(work[motion.shown[:-1]].sum()) / len(motion.orders)


def target(motion: Motion, field: str) -> float:
    """Height or distance ahead of the head's target [m]; NaN without visual lifting."""
    lifting = motion.scene.get("control.lifting")
    return float(lifting[field]) if lifting else np.nan


def sole(motion: Motion) -> float:
    """Length of the sole [m]."""
    foot = motion.scene.get("body.foot")
    return float(foot["toe"] + foot["heel"])
