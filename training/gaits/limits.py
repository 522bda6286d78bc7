"""The lines of a card: what a gait is measured by, and the limits of its values."""

from dataclasses import dataclass

import numpy as np

from skate_env.gait import QUANTITIES, Quantity, contact

from . import measures


@dataclass(frozen=True)
class Limit:
    """Closed range of a value; infinite where it is open."""

    at_least: float = -np.inf
    at_most: float = np.inf

    def met(self, value: float) -> bool:
        """Whether a value is inside; NaN is not."""
        return self.at_least <= value <= self.at_most

    def __str__(self) -> str:
        if self.at_least == self.at_most:
            return f"{self.at_least:g}"
        if np.isinf(self.at_least):
            return f"≤ {self.at_most:g}"
        if np.isinf(self.at_most):
            return f"≥ {self.at_least:g}"
        return f"{self.at_least:g} to {self.at_most:g}"


ONE = Limit(1.0, 1.0)

LINES: tuple[Quantity, ...] = (
    *QUANTITIES,
    Quantity(
        "time_in_15",
        "time in state 15",
        "ms",
        "mean per step; both feet flat and sliding",
        lambda m: 1e3 * contact.time_in(m, range(15, 16)),
    ),
    Quantity(
        "swap_from_14",
        "share of swaps from state 14",
        "1",
        "share of the steps whose last state of at least 2 ms is 14",
        lambda m: measures.share_ending_in(m, 14),
    ),
    Quantity(
        "heel_first",
        "share of landings heel first",
        "1",
        "share of the steps in which the free heel is lower than the toe in the first sample "
        "after the last landing",
        measures.heel_first,
    ),
    Quantity("sole", "sole length", "m", "heel to toe", measures.sole),
    Quantity(
        "target_height",
        "head target, height",
        "m",
        "height of the target of visual lifting above the ice",
        lambda m: measures.target(m, "height"),
    ),
    Quantity(
        "target_ahead",
        "head target, ahead",
        "m",
        "distance of the target ahead of the supporting ankle",
        lambda m: measures.target(m, "ahead"),
    ),
    Quantity(
        "pressure_outside",
        "share of time with the centre of pressure outside",
        "1",
        f"share of the time in which the centre of pressure of a foot with a net normal force of "
        f"at least {measures.LOADED:g} body weights, push or pull, is more than "
        f"{1e3 * measures.OUTSIDE:g} mm outside its sole",
        measures.outside_share,
    ),
    Quantity(
        "mean_lift",
        "mean lift on the head",
        "body weights",
        "mean vertical force of visual lifting and head damping",
        lambda m: measures.lift_over(m, np.mean),
    ),
    Quantity(
        "largest_lift",
        "largest lift on the head",
        "body weights",
        "largest value of the same force",
        lambda m: measures.lift_over(m, np.max),
    ),
    Quantity(
        "knees_backward",
        "knees bent backward",
        "rad",
        "largest of -q3 and q6, 0 if neither is positive",
        measures.knees_backward,
    ),
    Quantity(
        "work_of_tau1",
        "work of tau1",
        "J",
        "mean per step of the integral of tau1 q1', the external couple on the supporting foot",
        measures.work_of_tau1,
    ),
)

REQUIRED = {
    "in_order": ONE,
    "time_in_15": Limit(at_least=20.0),
    "swap_from_14": ONE,
    "free_foot_in_air": Limit(at_least=0.5),
    "heel_first": ONE,
    "deepest_toe": Limit(at_least=-5.0),
    "sole": Limit(0.22, 0.28),
    "target_height": Limit(at_most=1.72),
    "target_ahead": Limit(at_most=0.5),
    "largest_pull": Limit(at_most=3.0),
    "knees_backward": Limit(at_most=0.0),
}
"""Requirements on the paper's gait, by key."""
HUMAN = {
    "largest_pull": Limit(at_most=2.0),
    "ankle_torque": Limit(at_most=350.0),
    "largest_lift": Limit(at_most=1.0),
}
"""Stricter requirements on a gait that is possible for a human."""
