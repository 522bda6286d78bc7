"""The training reward: its terms, and its stages from lenient to strict.

Slide counts while the supporting foot is loaded. Steps count where the load moves to the other leg,
at most every 0.15 s (`Simulator.totals`), so that neither a rattling nor a flying foot is rewarded.
Each term prevents an exploit or a kind of fall; `docs/notes/training-results.md` compares them.
"""

from collections.abc import Mapping
from dataclasses import dataclass, fields
from typing import Any

import numpy as np
from numpy.typing import NDArray

from .contact_sequence import Progress

Array = NDArray[np.float64]
# Values at equally spaced stages; a single value is constant.
Staged = tuple[float, ...]
# Contact states of Table 2 with a flat, sliding supporting foot.
SLIDES_FLAT = np.array([state % 4 == 3 for state in range(21)])


def at(progress: float, values: Staged) -> float:
    """Interpolate values at a stage from 0 (first) to 1 (last)."""
    return float(np.interp(progress, np.linspace(0.0, 1.0, len(values)), values))


@dataclass(frozen=True)
class Weights:
    """Weights and limits of the reward terms by stage."""

    alive: Staged = (0.7,)
    """Per second without a fall, unless the gait step is longer than `longest_step` [1/s]."""
    slide: Staged = (1.0, 4.0, 4.0)
    """Per metre of slide of the loaded foot or of hip displacement, whichever is less, at speeds up
    to `fastest`, under the same condition [1/m]. Stepping back is therefore not rewarded."""
    step: Staged = (4.0, 10.0, 10.0)
    """Per metre of slide, up to `long_slide`, of the shorter of the last two gait steps, which
    prevents limping [1/m]. The factor falls to 0 from `shortest_step` to half of it."""
    flight: Staged = (1.0, 6.0, 25.0, 60.0)
    """Penalty per second of flight [1/s]."""
    double: Staged = (0.0,)
    """Per second of double support [1/s]."""
    trunk: Staged = (1.0,)
    """Penalty per second on the squared yaw and roll of the trunk [1/(s rad2)]."""
    order: Staged = (0.0,)
    """For each state of the paper's sequence reached in order, and once more for the complete step;
    reduced by flight and by a short slide."""
    dwell: Staged = (0.0,)
    """Per second in the states of the sequence, up to a limit in each gait step [1/s]."""
    brake: Staged = (0.0,)
    """For the deceleration of the rear toe to rest in states 16 and 14."""
    close: Staged = (0.0,)
    """Per second with the front foot close to the ice after flat double support [1/s]."""
    stray: Staged = (0.0,)
    """Penalty per second in flight or in single support without a flat sliding foot [1/s]."""
    hurry: Staged = (0.0,)
    """Penalty per metre of hip displacement beyond the speed `fastest` [1/m]."""
    head: Staged = (0.0,)
    """Penalty per second and metre of distance of the head from its target [1/(s m)]."""
    effort: Staged = (0.1,)
    """Penalty per second on the mean squared action [1/s]."""
    fall: Staged = (2.0,)
    """Penalty on a termination."""
    edge: Staged = (1.0, 1.0, 0.3)
    """Factor of slide on one sole end, relative to slide on a flat sole."""
    shortest_step: Staged = (0.25, 0.38, 0.4)
    """Shortest gait step with the full reward [s]."""
    longest_step: Staged = (1.0,)
    """Longest gait step with a reward [s]."""
    long_slide: Staged = (0.6,)
    """Largest rewarded slide of a gait step [m]."""
    fastest: Staged = (1.5,)
    """Largest rewarded speed [m/s]."""

    def at(self, progress: float) -> dict[str, float]:
        """Return all values at a stage from 0 to 1."""
        return {each.name: at(progress, getattr(self, each.name)) for each in fields(self)}


# Columns of the infos that `Counts` reads.
COUNTED = ("time", "steps", "flight_time", "double_support_time", "y_position")


class Counts:
    """State of the reward of n environments: last infos and quantities since the last leg swap."""

    def __init__(self, info: Mapping[str, Any]) -> None:
        self.time: Array = info["time"].copy()
        self.flight: Array = info["flight_time"].copy()
        self.double: Array = info["double_support_time"].copy()
        self.steps: NDArray[np.int64] = info["steps"].copy()
        self.slide = np.zeros_like(self.time)
        """Slide of the loaded foot since the last leg swap [m]."""
        self.y: Array = info["y_position"].copy()
        """Position of the hips [m]."""
        self.swap_y = self.y.copy()
        """Position of the hips at the last leg swap [m]."""
        self.swap_time = self.time.copy()
        """Time of the last leg swap [s]."""
        self.last_slide = np.zeros_like(self.time)
        """Rewarded slide of the last gait step [m]."""
        self.order = Progress(self.time.size)
        """Progress in the paper's sequence of contact states."""

    def replace(self, where: NDArray[np.bool_], others: "Counts") -> None:
        """Copy the state of other episodes."""
        self.order.replace(where, others.order)
        for name, mine in vars(self).items():
            if name != "order":
                mine[where] = vars(others)[name][where]


class Reward:
    """Computes the reward terms of an action.

    Parameters
    ----------
    weights
        Weights of the terms.
    names
        Names of the observation's elements.
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
            Stage of the training, 0 to 1.
        counts
            State before the action; it is updated in place.
        info
            Columns (n,) after the action; ``reward_slide`` is in metres.
        observations, actions
            Observations (n, d) after the action, actions (n, joints) in [-1, 1].
        ended
            Whether the action has ended the episode (n,).
        """
        w = self._weights.at(progress)
        dt = info["time"] - counts.time
        flat = SLIDES_FLAT[info["state_number"]]
        slide = info["reward_slide"] * np.where(flat, 1.0, w["edge"])
        counts.slide += slide
        forward = info["y_position"] - counts.y
        slide = np.minimum(slide, forward)
        period = info["time"] - counts.swap_time
        swapped = info["steps"] > counts.steps
        rewarded = period <= w["longest_step"]
        distance = np.minimum(counts.slide, info["y_position"] - counts.swap_y)
        step_slide = np.clip(distance, 0.0, w["long_slide"])
        step_slide *= np.clip(2.0 * period / w["shortest_step"] - 1.0, 0.0, 1.0)
        capped = np.clip(slide, -w["fastest"] * dt, w["fastest"] * dt)
        flight = info["flight_time"] - counts.flight
        sequence = counts.order.update(
            info["state_number"],
            dt,
            flight,
            step_slide,
            observations[:, self._slip],
            observations[:, self._free],
        )
        trunk = np.square(observations[:, self._trunk], dtype=np.float64).sum(axis=1)
        head = np.linalg.norm(observations[:, self._head].astype(np.float64), axis=1)
        terms = {
            "alive": w["alive"] * dt * rewarded,
            "slide": w["slide"] * capped * rewarded,
            "step": w["step"] * np.minimum(step_slide, counts.last_slide) * (swapped & rewarded),
            "flight": -w["flight"] * flight,
            "double": w["double"] * (info["double_support_time"] - counts.double),
            "trunk": -w["trunk"] * dt * trunk,
            "order": w["order"] * (sequence.reached + sequence.total * (swapped & rewarded)),
            "close": w["close"] * sequence.close,
            "brake": w["brake"] * sequence.brake,
            "dwell": w["dwell"] * sequence.dwell,
            "stray": -w["stray"] * dt * sequence.stray,
            "hurry": -w["hurry"] * np.maximum(forward - w["fastest"] * dt, 0.0),
            "head": -w["head"] * dt * head,
            "effort": -w["effort"] * dt * np.square(actions, dtype=np.float64).mean(axis=1),
            "fall": -w["fall"] * ended,
        }
        counts.time[:] = info["time"]
        counts.flight[:] = info["flight_time"]
        counts.double[:] = info["double_support_time"]
        counts.steps[:] = info["steps"]
        counts.last_slide[swapped] = step_slide[swapped]
        counts.slide[swapped] = 0.0
        counts.order.reset(swapped)
        counts.swap_y[swapped] = info["y_position"][swapped]
        counts.y[:] = info["y_position"]
        counts.swap_time[swapped] = info["time"][swapped]
        return terms
