"""Controllers that are not trained here: zero actions, random ones, and the shipped policies."""

from typing import Any

import gymnasium
import numpy as np

from skate_env.policies import Policy, shipped
from skate_env.registration import IDS

from .held_out import Act

UNTRAINED = ("zero", "random", "shipped")
POLICIES = dict(zip(IDS, ("paper", "push_only", "any_ice"), strict=True))


def untrained(env_id: str, name: str) -> tuple[Act, dict[str, Any]]:
    """Return zero or random actions or the shipped policy, and keywords of its environment."""
    if name == "shipped":
        policy = Policy.load(shipped(POLICIES[env_id]))
        keywords = {key: x for key, x in policy.environment().items() if key != "scene"}
        return lambda seen: policy.predict(seen)[0], keywords
    space, rng = gymnasium.make(env_id).action_space, np.random.default_rng(0)
    assert space.shape is not None
    (joints,), scale = space.shape, {"zero": 0.0, "random": 1.0}[name]
    return lambda seen: scale * rng.uniform(-1.0, 1.0, (len(seen), joints)), {}
