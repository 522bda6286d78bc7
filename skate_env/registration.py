"""Registration of the environments with Gymnasium, which ``import skate_env`` does.

``gymnasium.make("skate_env:IceSkate-v0")`` imports the package by itself, also in worker processes.
"""

from typing import Any

from gymnasium.envs import registration

_CLASSES = ("IceSkateEnv", "IceSkateVectorEnv")
# Single and vector environment, and keywords, by id. Learners need half as many actions of 20 ms.
# Without noise of the start every episode of a controller would be the same.
IDS: dict[str, tuple[tuple[str, str], dict[str, Any]]] = {
    "IceSkate-v0": (_CLASSES, {"action_period": 0.02, "action_scale": 40.0, "perturb": 0.08}),
    "IceSkatePushOnly-v0": (
        _CLASSES,
        {"scene": "push_only", "action_period": 0.02, "perturb": 0.02, "trunk_noise": 0.01},
    ),
    "IceSkateAnyIce-v0": (
        ("any_ice", "any_ice_vector"),
        {"action_period": 0.02, "perturb": 0.05, "trunk_noise": 0.02, "kick": 0.6},
    ),
}
# Time limit of an episode [s].
EPISODE = 30.0
# Mean return of 100 episodes from which a task counts as solved; the rewards allow 156.
SOLVED = {"IceSkate-v0": 75.0, "IceSkatePushOnly-v0": 50.0, "IceSkateAnyIce-v0": 40.0}


def register() -> None:
    """Register the environments that are not registered already."""
    for name, ((single, vector), keywords) in IDS.items():
        if name not in registration.registry:
            registration.register(
                id=name,
                entry_point=f"skate_env.environments:{single}",
                vector_entry_point=f"skate_env.environments:{vector}",
                kwargs=keywords,
                max_episode_steps=round(EPISODE / keywords["action_period"]),
                reward_threshold=SOLVED[name],
            )
