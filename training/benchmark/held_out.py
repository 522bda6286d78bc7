"""Evaluation of a controller of an id from starts that no training has seen."""

from collections.abc import Callable
from typing import Any

import gymnasium
import numpy as np
from numpy.typing import NDArray

from skate_env.registration import EPISODE

SEED = 10_000_000
# Steps that a skater makes, and the time in which it makes them [s].
GOALS = {"IceSkate-v0": (100, 60.0)}
GOAL = (20, 10.0)
Act = Callable[[NDArray[np.float32]], NDArray[np.floating]]
"""Actions (n, joints) from observations (n, size)."""


def evaluate(env_id: str, act: Act, starts: int = 256, **keywords: Any) -> dict[str, float]:
    """Run the episodes under the environment's own accuracy; ``keywords`` replace those of the id.

    Returns
    -------
    dict
        Means over the starts, in the first 30 s: ``return``, ``distance`` of the hips [m],
        ``steps``, ``seconds`` until the end, ``slide`` per step [m], ``flight`` as a share of the
        time. ``goal`` is the number of starts from which the steps of `GOALS` are made in time.
    """
    period = (gymnasium.spec(env_id).kwargs | keywords)["action_period"]
    wanted, limit = GOALS.get(env_id, GOAL)
    longest = max(limit, EPISODE)
    envs = gymnasium.make_vec(
        env_id,
        num_envs=starts,
        max_episode_steps=round(longest / period) + 1,
        autoreset_mode="Disabled",
        **keywords,
    )
    observations, infos = envs.reset(seed=SEED)
    keys = ("time", "steps", "y_position", "loaded_slide", "flight_time")
    begin = {key: infos[key].copy() for key in keys}
    last, total = dict(begin), np.zeros(starts)
    going, made = np.ones(starts, bool), np.zeros(starts, bool)
    for action in range(1, round(longest / period) + 1):
        observations, rewards, terminated, _, infos = envs.step(act(observations))
        if action * period < EPISODE + 0.5 * period:
            total += rewards * going
            last = {key: np.where(going, infos[key], last[key]) for key in keys}
        if action * period < limit + 0.5 * period:
            made |= going & (infos["steps"] >= wanted)
        going &= ~terminated
        if not going.any():
            break
        if terminated.any():
            # An ended episode needs a reset; the next one does not count.
            observations, _ = envs.reset(options={"reset_mask": terminated})
    envs.close()
    run = {key: last[key] - begin[key] for key in keys}
    return {
        "return": float(total.mean()),
        "distance": float(run["y_position"].mean()),
        "steps": float(run["steps"].mean()),
        "seconds": float(run["time"].mean()),
        "slide": float(run["loaded_slide"].sum() / max(run["steps"].sum(), 1)),
        "flight": float(run["flight_time"].sum() / run["time"].sum()),
        "goal": int(made.sum()),
        "starts": starts,
    }
