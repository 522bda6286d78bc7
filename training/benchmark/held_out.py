"""Evaluation of a controller of an id from starts that no training has seen."""

from collections.abc import Callable, Iterator
from typing import Any

import gymnasium
import numpy as np
from gymnasium.vector import VectorEnv
from numpy.typing import NDArray

from skate_env.registration import EPISODE

SEED, STARTS = 10_000_000, 256
# Steps that a skater makes, and the time in which it makes them [s].
GOALS = {"IceSkate-v0": (100, 60.0)}
GOAL = (20, 10.0)
Act = Callable[[NDArray[np.float32]], NDArray[np.floating]]
"""Actions (n, joints) from observations (n, size)."""


def play(
    envs: VectorEnv[Any, Any, Any], observations: NDArray[np.float32], act: Act
) -> Iterator[tuple[NDArray[np.float64], NDArray[np.bool_], dict[str, Any]]]:
    """Play one episode in each environment of a batch that has no autoreset.

    Yields, after each action, the rewards, which episodes went on until then, and the infos.
    """
    going = np.ones(envs.num_envs, np.bool_)
    while going.any():
        observations, rewards, terminated, truncated, infos = envs.step(act(observations))
        yield rewards, going, infos
        over = terminated | truncated
        going = going & ~over
        if over.any() and going.any():
            # An ended episode needs a reset; the next one does not count.
            observations, _ = envs.reset(options={"reset_mask": over})


def evaluate(env_id: str, act: Act, starts: int = STARTS, **keywords: Any) -> dict[str, float]:
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
        max_episode_steps=round(longest / period),
        autoreset_mode="Disabled",
        **keywords,
    )
    observations, infos = envs.reset(seed=SEED)
    keys = ("time", "steps", "y_position", "loaded_slide", "flight_time")
    begin = {key: infos[key].copy() for key in keys}
    last, total, made = dict(begin), np.zeros(starts), np.zeros(starts, np.bool_)
    for action, (rewards, going, infos) in enumerate(play(envs, observations, act), 1):
        if action <= round(EPISODE / period):
            total += rewards * going
            last = {key: np.where(going, infos[key], last[key]) for key in keys}
        if action <= round(limit / period):
            made |= going & (infos["steps"] >= wanted)
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
