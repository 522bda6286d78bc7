"""What the joints of a motion do, and what the controller pays: torques, rates, lift, work.

Functions return NaN, or an empty dictionary, for a motion without a complete step.
"""

from collections.abc import Callable

import numpy as np

from .._core import Simulator
from ..replay import Array
from .motion import Motion

ANKLES = ("q2", "q7")
# Sides of a step of the difference quotient that gives the head's velocity [s].
_STEP = 1e-6


def joints(motion: Motion) -> dict[str, int]:
    """Columns of the joints q1 to q17 that move."""
    names: list[str] = motion.recording.metadata["coordinate_names"]
    return {name: column for column, name in enumerate(names) if name.startswith("q")}


def peaks(motion: Motion, values: Array) -> dict[str, float]:
    """Largest magnitude of every joint's value (T, n) in the complete steps."""
    if not motion.shown.any():
        return {}
    largest = np.abs(values[motion.shown]).max(axis=0)
    return {name: float(largest[column]) for name, column in joints(motion).items()}


def largest(peak: dict[str, float]) -> float:
    """Largest of several values; NaN for none."""
    return max(peak.values(), default=np.nan)


def ankle_peak(motion: Motion) -> float:
    """Largest total torque of an ankle [N m]."""
    found = peaks(motion, motion.samples.torque)
    return max((found[name] for name in ANKLES if name in found), default=np.nan)


def knees_backward(motion: Motion) -> float:
    """Largest angle by which a knee bends backward [rad]."""
    bent = [
        sign * motion.samples.q[motion.shown, column]
        for name, sign in (("q3", -1.0), ("q6", 1.0))
        if (column := motion.recording.index(name)) is not None
    ]
    return max(0.0, float(np.max(bent))) if bent and motion.shown.any() else np.nan


def lift(motion: Motion) -> Array:
    """Vertical force of lifting and head damping in the complete steps [body weights].

    Zero with both feet in the air, where the controller exerts none.
    """
    shown = motion.shown
    force = np.zeros(np.count_nonzero(shown))
    if lifting := motion.scene.get("control.lifting"):
        force += lifting["K_p"][2] * (lifting["height"] - motion.samples.psi[shown])
    damping = motion.scene.get("stabilizers.head_damping")
    if damping and damping["z"] != 0.0:
        force -= damping["z"] * _head_rate(motion)
    return np.where(motion.samples.state_number[shown] == 0, 0.0, force) / motion.weight


def _head_rate(motion: Motion) -> Array:
    """Vertical velocity of the head relative to the supporting ankle (shown,) [m/s]."""
    sim = Simulator(motion.recording.scene)
    q, v = motion.samples.q[motion.shown], motion.samples.v[motion.shown]
    heights = [[_head_height(sim, x) for x in q + side * _STEP * v] for side in (-1.0, 1.0)]
    rate: Array = np.diff(np.array(heights), axis=0)[0] / (2.0 * _STEP)
    return rate


def _head_height(sim: Simulator, q: Array) -> float:
    segments = sim.link_segments(q)
    return float(segments[16, 1, 2] - segments[1, 0, 2])


def work_of_tau1(motion: Motion) -> float:
    """Mean work of tau1, the couple on the supporting foot, per step [J]."""
    column = motion.recording.index("q1")
    if column is None or not motion.orders:
        return np.nan
    power = motion.feedforward[:, column] * motion.samples.v[:, column]
    t = motion.samples.t
    # The couple and its power begin and end with states, so a sample holds for its period.
    return float((power[:-1] * np.diff(t))[motion.shown[:-1]].sum()) / len(motion.orders)


def lift_over(motion: Motion, reduce: Callable[[Array], float]) -> float:
    """Mean or largest `lift` [body weights]."""
    return float(reduce(lift(motion))) if motion.shown.any() else np.nan


def target(motion: Motion, field: str) -> float:
    """Height or distance ahead of the head's target [m]; NaN without visual lifting."""
    lifting = motion.scene.get("control.lifting")
    return float(lifting[field]) if lifting else np.nan


def standing_height(motion: Motion) -> float:
    """Height of the head of the upright robot [m]."""
    body = motion.scene.get("body")
    links = ("lower_leg", "upper_leg", "lower_body", "middle_body", "upper_body", "head")
    return float(body["foot"]["height"] + sum(body[link]["length"] for link in links))
