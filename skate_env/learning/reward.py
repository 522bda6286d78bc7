"""The training reward: its terms, and its stages from lenient to strict.

Slide counts while the supporting foot is loaded, and steps count where the load passes from leg to
leg, at most every 0.15 s (`Simulator.totals`): so a foot that rattles, and one that flies, earn
nothing. Each term answers an exploit, or a way to fall; `training/README.md` shows which matter.
"""

from collections.abc import Mapping
from dataclasses import dataclass, fields
from typing import Any

import numpy as np
from numpy.typing import NDArray

from .contact_sequence import Progress

Array = NDArray[np.float64]
# A number at stages that follow each other evenly; one alone never changes.
Staged = tuple[float, ...]
# Contact states with the sole of the supporting foot flat on the ice and sliding: Table 2.
SLIDES_FLAT = np.array([state % 4 == 3 for state in range(21)])


def at(progress: float, values: Staged) -> float:
    """Give a number at a stage from 0, the first, to 1, the last."""
    return float(np.interp(progress, np.linspace(0.0, 1.0, len(values)), values))


@dataclass(frozen=True)
class Weights:
    """What the terms are worth, and where they begin, stage by stage."""

    alive: Staged = (0.7,)
    """For each second on the feet, unless the step takes longer than `longest_step`."""
    slide: Staged = (1.0, 4.0, 4.0)
    """For each metre that the loaded foot slides and the hips come forward, whichever is less, as
    far as `fastest`; likewise. Who slides forward and steps back earns nothing."""
    step: Staged = (4.0, 10.0, 10.0)
    """For each metre, counted in the same way up to `long_slide`, of the worse of the last two
    steps: a limp does not pay. Steps below `shortest_step` count less, those of half of it nothing.
    """
    flight: Staged = (1.0, 6.0, 25.0, 60.0)
    """Against each second with both feet in the air."""
    double: Staged = (0.0,)
    """For each second with both feet on the ice."""
    trunk: Staged = (1.0,)
    """Against each second of trunk's yaw and roll of a radian, squared."""
    order: Staged = (0.0,)
    """For each state reached of the paper's order, and again for the whole step; less for little
    slide and for both feet in the air."""
    dwell: Staged = (0.0,)
    """For each second in a state of the order after all before it, for a while in each step."""
    brake: Staged = (0.0,)
    """For a rear toe that comes to rest in states 16 and 14."""
    close: Staged = (0.0,)
    """For each second with the front foot close to the ice, once both soles were flat on it."""
    stray: Staged = (0.0,)
    """Against each second on one foot that is not flat and sliding, or on none."""
    hurry: Staged = (0.0,)
    """Against each metre of the hips beyond `fastest`."""
    head: Staged = (0.0,)
    """Against each second with the head a metre from its target."""
    effort: Staged = (0.1,)
    """Against each second of a full residual in all joints, squared."""
    fall: Staged = (2.0,)
    """Against an end."""
    edge: Staged = (1.0, 1.0, 0.3)
    """What a metre on the edge of a sole counts, beside one on the whole sole."""
    shortest_step: Staged = (0.25, 0.38, 0.4)
    """[s]"""
    longest_step: Staged = (1.0,)
    """[s]"""
    long_slide: Staged = (0.6,)
    """[m]"""
    fastest: Staged = (1.5,)
    """[m/s]"""

    def at(self, progress: float) -> dict[str, float]:
        """Give the numbers at a stage from 0 to 1."""
        return {each.name: at(progress, getattr(self, each.name)) for each in fields(self)}


# What `Counts` are made of.
COUNTED = ("time", "steps", "flight_time", "double_support_time", "y_position")


class Counts:
    """What environments have come to: columns of the batch's infos, and since the last step."""

    def __init__(self, info: Mapping[str, Any]) -> None:
        self.time: Array = info["time"].copy()
        self.flight: Array = info["flight_time"].copy()
        self.double: Array = info["double_support_time"].copy()
        self.steps: NDArray[np.int64] = info["steps"].copy()
        self.slid = np.zeros_like(self.time)
        """By the loaded foot since the last step [m]."""
        self.y: Array = info["y_position"].copy()
        """Of the hips [m]."""
        self.begun = self.y.copy()
        """Of the hips at the last step [m]."""
        self.since = self.time.copy()
        """When that was [s]."""
        self.worth = np.zeros_like(self.time)
        """What it was worth [m]."""
        self.order = Progress(self.time.size)
        """In the paper's order of contact states."""

    def replace(self, where: NDArray[np.bool_], others: "Counts") -> None:
        """Take over those of other episodes."""
        self.order.replace(where, others.order)
        for name, mine in vars(self).items():
            if name != "order":
                mine[where] = vars(others)[name][where]


class Reward:
    """Terms of the reward of an action.

    Parameters
    ----------
    weights
        What they are worth.
    names
        Of an observation's numbers.
    """

    def __init__(self, weights: Weights, names: list[str]) -> None:
        self._weights = weights
        self._trunk = [i for i, name in enumerate(names) if name in ("angle.q8", "angle.q10")]
        self._slip = names.index("slip.support")
        self._free = [names.index("height.free_heel"), names.index("height.free_toe")]
        self._head = [i for i, name in enumerate(names) if name.startswith("head_error.")]

    def terms(
        self,
        progress: float,
        counts: Counts,
        info: Mapping[str, Any],
        observations: NDArray[np.float32],
        actions: NDArray[np.float32],
        ended: NDArray[np.bool_],
    ) -> dict[str, Array]:
        """Compute the terms of one action in each of n environments, and update the counts.

        Parameters
        ----------
        progress
            From the first stage, 0, to the last, 1.
        counts
            Before the action; after it, when this returns.
        info
            Columns (n,) after the action; ``reward_slide`` holds metres.
        observations, actions
            (n, d) after the action, (n, joints) between -1 and 1.
        ended
            Which episodes the action has ended, (n,).
        """
        w = self._weights.at(progress)
        dt = info["time"] - counts.time
        flat = SLIDES_FLAT[info["state_number"]]
        slide = info["reward_slide"] * np.where(flat, 1.0, w["edge"])
        counts.slid += slide
        forward = info["y_position"] - counts.y
        slide = np.minimum(slide, forward)
        period = info["time"] - counts.since
        swapped = info["steps"] > counts.steps
        goes_on = period <= w["longest_step"]
        way = np.minimum(counts.slid, info["y_position"] - counts.begun)
        worth = np.clip(way, 0.0, w["long_slide"])
        worth *= np.clip(2.0 * period / w["shortest_step"] - 1.0, 0.0, 1.0)
        capped = np.clip(slide, -w["fastest"] * dt, w["fastest"] * dt)
        aloft = info["flight_time"] - counts.flight
        paid = counts.order.follow(
            info["state_number"],
            dt,
            aloft,
            worth,
            observations[:, self._slip],
            observations[:, self._free],
        )
        trunk = np.square(observations[:, self._trunk], dtype=np.float64).sum(axis=1)
        head = np.linalg.norm(observations[:, self._head].astype(np.float64), axis=1)
        terms = {
            "alive": w["alive"] * dt * goes_on,
            "slide": w["slide"] * capped * goes_on,
            "step": w["step"] * np.minimum(worth, counts.worth) * (swapped & goes_on),
            "flight": -w["flight"] * aloft,
            "double": w["double"] * (info["double_support_time"] - counts.double),
            "trunk": -w["trunk"] * dt * trunk,
            "order": w["order"] * (paid.came + paid.whole * (swapped & goes_on)),
            "close": w["close"] * paid.close,
            "brake": w["brake"] * paid.braked,
            "dwell": w["dwell"] * paid.dwelt,
            "stray": -w["stray"] * dt * paid.strays,
            "hurry": -w["hurry"] * np.maximum(forward - w["fastest"] * dt, 0.0),
            "head": -w["head"] * dt * head,
            "effort": -w["effort"] * dt * np.square(actions, dtype=np.float64).mean(axis=1),
            "fall": -w["fall"] * ended,
        }
        counts.time[:] = info["time"]
        counts.flight[:] = info["flight_time"]
        counts.double[:] = info["double_support_time"]
        counts.steps[:] = info["steps"]
        counts.worth[swapped] = worth[swapped]
        counts.slid[swapped] = 0.0
        counts.order.begin(swapped)
        counts.begun[swapped] = info["y_position"][swapped]
        counts.y[:] = info["y_position"]
        counts.since[swapped] = info["time"][swapped]
        return terms
