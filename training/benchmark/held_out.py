"""Evaluation of a learner in episodes of 10 s, from 32 starts that no training has seen."""

from collections.abc import Callable

import gymnasium
import numpy as np
from numpy.typing import NDArray

STARTS, SECONDS, ENOUGH, SEED = 32, 10.0, 20, 1_000_000
Act = Callable[[NDArray[np.float32]], NDArray[np.float32]]
"""Actions (n, joints) from observations (n, size)."""


def action_period(env_id: str) -> float:
    """Duration of an action of an id [s]; that of the presets, unless its keywords name one."""
    period: float = gymnasium.spec(env_id).kwargs.get("action_period", 0.01)
    return period


def evaluate(env_id: str, act: Act) -> dict[str, float]:
    """Run the episodes under the environment's own accuracy.

    Returns
    -------
    dict
        ``steps`` is the median of the gait steps, ``share`` the share of the episodes with at least
        20 of them, ``seconds`` the mean duration [s], ``return`` the mean return, and ``flight``
        the share of the time with both feet in the air.
    """
    actions = round(SECONDS / action_period(env_id))
    envs = gymnasium.make_vec(
        env_id, num_envs=STARTS, max_episode_steps=actions, autoreset_mode="Disabled"
    )
    observations, _ = envs.reset(seed=SEED)
    steps, seconds, flight, total = np.zeros((4, STARTS))
    over = np.zeros(STARTS, bool)
    while not over.all():
        observations, rewards, terminated, truncated, infos = envs.step(act(observations))
        going, ended = ~over, terminated | truncated
        steps[going], seconds[going] = infos["steps"][going], infos["time"][going]
        flight[going] = infos["flight_time"][going]
        total[going] += rewards[going]
        over |= ended
        if ended.any():
            # An ended episode needs a reset; the next one does not count.
            observations, _ = envs.reset(options={"reset_mask": ended})
    envs.close()
    return {
        "steps": float(np.median(steps)),
        "share": float(np.mean(steps >= ENOUGH)),
        "seconds": float(seconds.mean()),
        "return": float(total.mean()),
        "flight": float(flight.sum() / seconds.sum()),
    }
