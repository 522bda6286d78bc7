"""Evaluation episodes of a controller, from starts that are the same for every controller."""

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from typing import Any, Protocol

import numpy as np
from gymnasium.vector import AutoresetMode
from numpy.typing import NDArray

from .._core import Scene, Simulator
from ..contact_sequence import ORDER, Event, StepOrder, step_orders
from ..scenes import as_scene
from ..scenes import replace as changed
from ..vector import IceSkateVectorEnv
from . import FIRST_EVALUATION_SEED
from .contact_sequence import DOUBLE

Array = NDArray[np.float64]


class Controller(Protocol):
    """A map from observations to actions, as in Stable-Baselines3."""

    @property
    def scene(self) -> Scene:
        """What it skates on."""
        ...

    def predict(
        self,
        observation: NDArray[np.float32],
        state: Any = None,
        episode_start: Any = None,
        deterministic: bool = True,
    ) -> tuple[NDArray[np.float32], Any]:
        """Return actions, and a state that is not used."""
        ...


@dataclass(frozen=True)
class Conditions:
    """Conditions of an evaluation, the same for all controllers.

    Attributes
    ----------
    episodes
        Number of episodes, each from a start of its own.
    steps
        An episode is complete after so many: the load passed to the other leg.
    longest
        An episode ends after this time [s].
    disturbances
        Keywords of the environment: ``perturb``, ``trunk_noise``, ``kick``.
    accuracy
        The engine's.
    """

    episodes: int = 64
    steps: int = 100
    longest: float = 200.0
    disturbances: Mapping[str, float] = field(default_factory=dict)
    accuracy: str = "balanced"


# Figures of an episode, with their units.
UNITS = {
    "steps": "1",
    "completed": "1",
    "time": "s",
    "period": "s",
    "loaded_slide": "m a step",
    # Of the leg that slides less: a limp has little of it.
    "weaker_leg_slide": "m a step",
    "flight": "of the time",
    "double_support": "of the time",
    "head_error": "m",
    "effort": "1",
    "work": "J/m",
    "inadmissible": "of the time",
    "fell": "1",
}
# The paper's order: 3-7-15-16-14, others between them allowed; the same but for 14; double support
# on heel and flat foot, the median, and how often it is 30 ms or more; time in other states.
ORDER_FIGURES = {
    "in_order": "of the steps",
    "in_order_to_16": "of the steps",
    "heel_and_flat": "s a step",
    "long_heel_and_flat": "of the steps",
    "out_of_order": "of the time",
}
UNITS |= ORDER_FIGURES
# Actions between two looks at the events, of which a simulator keeps the last thousand.
LOOK = 10


def run(
    controller: Controller,
    environment: Mapping[str, Any],
    conditions: Conditions,
    *,
    deterministic: bool = True,
    progress: Callable[[int], object] = lambda _: None,
) -> dict[str, Array]:
    """Skate from every start until the steps are made, the time is over or the robot cannot go on.

    Parameters
    ----------
    controller
        Maps observations to actions.
    environment
        Its keywords of `IceSkateVectorEnv`.
    conditions
        Starts and lengths.
    deterministic
        Whether the controller does without noise.
    progress
        Called with 1 for each episode that is over.

    Returns
    -------
    dict
        `UNITS` by name, (episodes,). NaN where an episode has none: no step, no time.
    """
    n = conditions.episodes
    scene = changed(as_scene(environment["scene"]), {"energy_balance": True})
    keywords = {**environment, **conditions.disturbances, "scene": scene}
    envs = IceSkateVectorEnv(
        n,
        max_episode_steps=None,
        # An ended episode stays available until the next reset.
        autoreset_mode=AutoresetMode.NEXT_STEP,
        accuracy=conditions.accuracy,
        **keywords,
    )
    error = [i for i, name in enumerate(envs.observation_names) if name.startswith("head_error.")]
    side = envs.observation_names.index("support_leg")
    rows: list[dict[str, float]] = [{} for _ in range(n)]
    head, effort, actions_made = np.zeros(n), np.zeros(n), 0
    running, left, right = np.ones(n, np.bool_), np.zeros(n), np.zeros(n)
    events: list[list[Event]] = [[] for _ in range(n)]
    swaps: list[list[float]] = [[] for _ in range(n)]
    steps = np.zeros(n, np.int64)
    observations, begun = envs.reset(seed=[FIRST_EVALUATION_SEED + i for i in range(n)])
    while running.any():
        actions, _ = controller.predict(observations, deterministic=deterministic)
        observations, _, terminated, _, info = envs.step(actions)
        actions_made += 1
        head += np.linalg.norm(observations[:, error], axis=1)
        effort += np.square(actions, dtype=np.float64).mean(axis=1)
        left += np.where(observations[:, side] < 0.0, info["reward_slide"], 0.0)
        right += np.where(observations[:, side] > 0.0, info["reward_slide"], 0.0)
        swapped = info["steps"] > steps
        steps = info["steps"]
        for i in np.flatnonzero(swapped & running).tolist():
            swaps[i].append(float(info["time"][i]))
        over = terminated | (info["steps"] >= conditions.steps)
        over |= info["time"] >= conditions.longest
        looked = running & (over | (actions_made % LOOK == 0))
        for i in np.flatnonzero(looked).tolist():
            events[i] += _after(envs.simulator(i).take_events(), events[i])
        for i in np.flatnonzero(over & running).tolist():
            sums = {"head_error": head[i] / actions_made, "effort": effort[i] / actions_made}
            way = info["y_position"][i] - begun["y_position"][i]
            weaker = min(left[i], right[i])
            rows[i] = sums | _figures(envs.simulator(i), way, weaker, conditions.steps)
            rows[i] |= _order_figures(step_orders(events[i], swaps[i]), swaps[i])
            progress(1)
        running &= ~over
    envs.close()
    return {name: np.array([row[name] for row in rows]) for name in UNITS}


def _figures(sim: Simulator, way: float, weaker: float, steps: int) -> dict[str, float]:
    """Compute the figures of an episode at its end."""
    totals, records = sim.totals(), sim.take_steps()
    made = totals["steps"]
    stepped = sum(record["period"] for record in records)
    inadmissible = sum(record["inadmissible_time"] for record in records)
    # An episode may end at its start.
    lasted = sim.time if sim.time > 0.0 else np.nan
    return {
        "steps": made,
        "completed": float(made >= steps),
        "time": sim.time,
        "period": sim.time / made if made else np.nan,
        "loaded_slide": totals["loaded_slide"] / made if made else np.nan,
        # Each leg makes half of the steps.
        "weaker_leg_slide": 2.0 * weaker / made if made else np.nan,
        "flight": totals["flight_time"] / lasted,
        "double_support": totals["double_support_time"] / lasted,
        "work": sim.energy_balance()["actuators"] / way if way > 0.0 else np.nan,
        # Known of whole steps only.
        "inadmissible": inadmissible / stepped if stepped else np.nan,
        "fell": float(sim.termination is not None),
    }


def _after(events: list[Event], known: list[Event]) -> list[Event]:
    """Return those events that come after the last known one."""
    if known and known[-1] in events:
        return events[len(events) - events[::-1].index(known[-1]) :]
    return events


def _order_figures(orders: list[StepOrder], swaps: list[float]) -> dict[str, float]:
    """Compute the figures of the contact sequence; NaN without a step between two leg swaps."""
    if not orders:
        return dict.fromkeys(ORDER_FIGURES, np.nan)
    reached = np.array([step.reached for step in orders])
    double = np.array([step.double for step in orders])
    aside = sum(step.aside for step in orders) / (swaps[-1] - swaps[0])
    values = (
        np.mean(reached == len(ORDER)),
        np.mean(reached >= len(ORDER) - 1),
        np.median(double),
        np.mean(double >= DOUBLE),
        aside,
    )
    return {name: float(value) for name, value in zip(ORDER_FIGURES, values, strict=True)}
