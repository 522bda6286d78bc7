"""What a gait is described by: one number each, with its unit and its definition."""

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from . import contact
from .motion import Motion


@dataclass(frozen=True)
class Quantity:
    """A number that describes a motion.

    Attributes
    ----------
    key
        Name for programs.
    name, unit, definition
        For people; the unit of shares and counts is 1.
    measure
        Value of a motion; NaN where there is none.
    """

    key: str
    name: str
    unit: str
    definition: str
    measure: Callable[[Motion], float]

    @property
    def title(self) -> str:
        """Name with the unit."""
        return self.name if self.unit == "1" else f"{self.name} [{self.unit}]"


QUANTITIES: tuple[Quantity, ...] = (
    Quantity(
        "in_order",
        "share of steps in the order 3-7-15-16-14-3",
        "1",
        "share of the steps whose contact states are exactly the order; see the rule",
        lambda m: contact.order_share(m.orders, standing_as_sliding=False),
    ),
    Quantity(
        "in_order_standing",
        "the same with state 1 counted as state 3",
        "1",
        "state 1 (supporting foot sticks) counts as state 3 (it slides)",
        lambda m: contact.order_share(m.orders, standing_as_sliding=True),
    ),
    Quantity(
        "period", "period", "s", "mean time between two swaps", lambda m: m.step_mean("period")
    ),
    Quantity(
        "progress",
        "step length",
        "m",
        "mean progress of the hips per step",
        lambda m: m.step_mean("progress"),
    ),
    Quantity(
        "speed",
        "speed",
        "m/s",
        "progress of the hips over time",
        lambda m: m.step_mean("progress") / m.step_mean("period"),
    ),
    Quantity(
        "slide",
        "slide per step",
        "m",
        "mean displacement of the supporting foot while sliding",
        lambda m: m.step_mean("slide"),
    ),
    Quantity(
        "double_support",
        "double support",
        "s",
        "mean time per step in states 5 to 20, both feet on the ice",
        lambda m: contact.time_in(m, contact.DOUBLE_SUPPORT),
    ),
    Quantity(
        "free_foot_in_air",
        "share of time with the free foot in the air",
        "1",
        "share of the time in states 0 to 4",
        contact.share_in_air,
    ),
    Quantity(
        "flight",
        "both feet in the air",
        "s",
        "mean time per step in state 0",
        lambda m: contact.time_in(m, range(1)),
    ),
    Quantity(
        "deepest_toe",
        "deepest free toe",
        "mm",
        "smallest height of the free toe, negative below the ice",
        contact.deepest_toe,
    ),
    Quantity(
        "largest_push",
        "largest push of an end",
        "body weights",
        "largest normal force of the four ends of the soles",
        lambda m: contact.largest_load(m, 1.0),
    ),
    Quantity(
        "largest_pull",
        "largest pull of an end",
        "body weights",
        "largest negative normal force of the four ends of the soles",
        lambda m: contact.largest_load(m, -1.0),
    ),
    Quantity(
        "ankle_torque",
        "peak ankle torque",
        "N m",
        "largest total torque of q2 and q7",
        lambda m: max((x for q, x in m.torques.items() if q in ("q2", "q7")), default=np.nan),
    ),
    Quantity(
        "joint_torque",
        "peak joint torque",
        "N m",
        "largest total torque of a joint q1 to q17, with that of a policy",
        lambda m: max(m.torques.values(), default=np.nan),
    ),
    Quantity(
        "joint_rate",
        "peak joint rate",
        "rad/s",
        "largest rate of a joint q1 to q17",
        lambda m: max(m.peaks(m.recording.v).values(), default=np.nan),
    ),
)
