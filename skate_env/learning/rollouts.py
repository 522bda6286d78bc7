"""Evaluation episodes of a controller, from starts that are the same for every controller."""

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from typing import Any

import numpy as np
from gymnasium.vector import AutoresetMode
from numpy.typing import NDArray

from .._core import Simulator
from ..environments import IceSkateVectorEnv
from ..gait import ORDER, Event, StepOrder, step_orders
from ..policies import OrbitPolicy, Policy, baseline
from ..scenes import as_scene
from ..scenes import replace as changed
from . import FIRST_EVALUATION_SEED

Array = NDArray[np.float64]


Controller = Policy | OrbitPolicy | baseline.Baseline
"""A map from observations to actions, with the scene of its environments."""


@dataclass(frozen=True)
class Conditions:
    """Conditions of an evaluation, the same for all controllers.

    Attributes
    ----------
    episodes
        Number of episodes, each with a different start.
    steps
        Number of gait steps (leg swaps) after which an episode is complete.
    longest
        Time limit of an episode [s].
    disturbances
        Environment keywords ``perturb``, ``trunk_noise`` and ``kick``.
    accuracy
        Accuracy of the engine.
    """

    episodes: int = 256
    steps: int = 100
    longest: float = 200.0
    disturbances: Mapping[str, float] = field(default_factory=dict)
    accuracy: Any = "balanced"


# Statistics of an episode, with their units.
UNITS = {
    "steps": "1",
    "completed": "1",
    "time": "s",
    "period": "s",
    "loaded_slide": "m per step",
    # Of the leg that slides less; small for a limp.
    "weaker_leg_slide": "m per step",
    "flight": "of the time",
    "double_support": "of the time",
    "head_error": "m",
    "effort": "1",
    "work": "J/m",
    "inadmissible": "of the time",
    "fell": "1",
}
# Statistics of the paper's sequence: steps with 3-7-15-16-14 in this order; with 3-7-15-16; median
# duration of heel and flat double support; share of at least 30 ms; share of time in other states.
ORDER_STATISTICS = {
    "in_order": "of the steps",
    "in_order_to_16": "of the steps",
    "heel_and_flat": "s per step",
    "long_heel_and_flat": "of the steps",
    "out_of_order": "of the time",
}
UNITS |= ORDER_STATISTICS
# Shortest heel and flat double support in a step of the paper's kind [s].
DOUBLE = 0.03
# Actions between two reads of the events, of which a simulator keeps the last thousand.
EVENT_PERIOD = 10


def run(
    controller: Controller,
    environment: Mapping[str, Any],
    conditions: Conditions,
    *,
    deterministic: bool = True,
    progress: Callable[[int], object] = lambda _: None,
) -> dict[str, Array]:
    """Simulate every start until the steps are complete, the time limit or a termination.

    Parameters
    ----------
    controller
        Maps observations to actions.
    environment
        Keywords of `IceSkateVectorEnv`.
    conditions
        Starts and limits.
    deterministic
        Whether the controller acts without noise.
    progress
        Called with 1 at the end of each episode.

    Returns
    -------
    dict
        Statistics (episodes,) by name, see `UNITS`; NaN where undefined (no step, no time).
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
    rows: list[dict[str, float]] = [{} for _ in range(n)]
    head, effort, actions_made = np.zeros(n), np.zeros(n), 0
    running, left, right, slid = np.ones(n, np.bool_), np.zeros(n), np.zeros(n), np.zeros(n)
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
        slide, slid = info["loaded_slide"] - slid, info["loaded_slide"]
        on_left = info["support_leg"] == "left"
        left += np.where(on_left, slide, 0.0)
        right += np.where(on_left, 0.0, slide)
        swapped = info["steps"] > steps
        steps = info["steps"]
        for i in np.flatnonzero(swapped & running).tolist():
            swaps[i].append(float(info["time"][i]))
        over = terminated | (info["steps"] >= conditions.steps)
        over |= info["time"] >= conditions.longest
        read_events = running & (over | (actions_made % EVENT_PERIOD == 0))
        for i in np.flatnonzero(read_events).tolist():
            events[i] += _after(envs.simulator(i).take_events(), events[i])
        for i in np.flatnonzero(over & running).tolist():
            sums = {"head_error": head[i] / actions_made, "effort": effort[i] / actions_made}
            distance = info["y_position"][i] - begun["y_position"][i]
            weaker = min(left[i], right[i])
            rows[i] = sums | _statistics(envs.simulator(i), distance, weaker, conditions.steps)
            rows[i] |= _order_statistics(step_orders(events[i], swaps[i]), swaps[i])
            progress(1)
        running &= ~over
    envs.close()
    return {name: np.array([row[name] for row in rows]) for name in UNITS}


def _statistics(sim: Simulator, distance: float, weaker: float, steps: int) -> dict[str, float]:
    """Compute the statistics of an episode at its end."""
    totals, records = sim.totals(), sim.take_steps()
    made = totals["steps"]
    step_time = sum(record["period"] for record in records)
    inadmissible = sum(record["inadmissible_time"] for record in records)
    # An episode may end at its start.
    duration = sim.time if sim.time > 0.0 else np.nan
    return {
        "steps": made,
        "completed": float(made >= steps),
        "time": sim.time,
        "period": sim.time / made if made else np.nan,
        "loaded_slide": totals["loaded_slide"] / made if made else np.nan,
        # Each leg makes half of the steps.
        "weaker_leg_slide": 2.0 * weaker / made if made else np.nan,
        "flight": totals["flight_time"] / duration,
        "double_support": totals["double_support_time"] / duration,
        "work": sim.energy_balance()["actuators"] / distance if distance > 0.0 else np.nan,
        # Known for complete steps only.
        "inadmissible": inadmissible / step_time if step_time else np.nan,
        "fell": float(sim.termination is not None),
    }


def _after(events: list[Event], known: list[Event]) -> list[Event]:
    """Return the events after the last known one."""
    if known and known[-1] in events:
        return events[len(events) - events[::-1].index(known[-1]) :]
    return events


def _order_statistics(orders: list[StepOrder], swaps: list[float]) -> dict[str, float]:
    """Compute the statistics of the sequence; NaN without a step between two leg swaps."""
    if not orders:
        return dict.fromkeys(ORDER_STATISTICS, np.nan)
    reached = np.array([step.reached for step in orders])
    double = np.array([step.double for step in orders])
    other_time = sum(step.other_time for step in orders) / (swaps[-1] - swaps[0])
    values = (
        np.mean(reached == len(ORDER)),
        np.mean(reached >= len(ORDER) - 1),
        np.median(double),
        np.mean(double >= DOUBLE),
        other_time,
    )
    return {name: float(value) for name, value in zip(ORDER_STATISTICS, values, strict=True)}
