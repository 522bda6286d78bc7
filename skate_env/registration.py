"""Registration of the environments with Gymnasium.

``gymnasium.make("IceSkate-v0")`` works without ``import skate_env``, also in worker processes of
Stable-Baselines3 and RLlib. Gymnasium 1.0 and later do not load the entry points of installed
packages, so the package installs ``skate_env_startup.pth`` (source: ``startup/purelib``). Python
runs this one line at start-up. It adds a finder to ``sys.meta_path``, which takes about 0.1 ms, and
imports this module only when the program imports Gymnasium. A damaged or removed package leaves
Gymnasium unchanged.

This module imports nothing else of the package, as Gymnasium is still being imported then.
"""

import sys
from collections.abc import Sequence
from contextlib import suppress
from importlib.machinery import ModuleSpec, PathFinder
from types import ModuleType
from typing import Any

_REGISTRY = "gymnasium.envs.registration"
_CLASSES = ("env:IceSkateEnv", "vector:IceSkateVectorEnv")
# Entry points of the single and the vector environment, and keywords, by id. Learners need half as
# many actions of 20 ms.
IDS: dict[str, tuple[tuple[str, str], dict[str, Any]]] = {
    "IceSkate-v0": (_CLASSES, {}),
    "IceSkatePushOnly-v0": (
        _CLASSES,
        {"scene": "push_only", "action_period": 0.02, "perturb": 0.02, "trunk_noise": 0.01},
    ),
    "IceSkateAnyIce-v0": (
        ("tasks:any_ice", "tasks:any_ice_vector"),
        {"action_period": 0.02, "perturb": 0.05, "trunk_noise": 0.02, "kick": 0.6},
    ),
}
# Time limit of an episode [s].
EPISODE = 30.0
# Mean return of 100 episodes from which a task counts as solved; the rewards allow 690.
SOLVED = {"IceSkate-v0": 440.0, "IceSkatePushOnly-v0": 500.0, "IceSkateAnyIce-v0": 400.0}


def register() -> None:
    """Register the environments that are not registered already."""
    from gymnasium.envs import registration

    for name, ((single, vector), keywords) in IDS.items():
        if name not in registration.registry:
            registration.register(
                id=name,
                entry_point=f"skate_env.{single}",
                vector_entry_point=f"skate_env.{vector}",
                kwargs=keywords,
                max_episode_steps=round(EPISODE / keywords.get("action_period", 0.01)),
                reward_threshold=SOLVED[name],
            )


def register_on_import() -> None:
    """Register the environments now, or as soon as Gymnasium is imported."""
    if _REGISTRY in sys.modules:
        register()
    elif not any(isinstance(finder, Finder) for finder in sys.meta_path):
        sys.meta_path.insert(0, Finder())


class Finder:
    """Import hook: finds Gymnasium's registry, and registers the environments after its import."""

    def find_spec(
        self, name: str, path: Sequence[str] | None, target: ModuleType | None = None
    ) -> ModuleSpec | None:
        """Return None for every other module."""
        if name != _REGISTRY:
            return None
        spec = PathFinder.find_spec(name, path, target)
        if spec is None or spec.loader is None:
            return None
        execute = spec.loader.exec_module

        def execute_and_register(module: ModuleType) -> None:
            execute(module)
            # An error here must not break the import of Gymnasium.
            with suppress(Exception):
                register()

        spec.loader.exec_module = execute_and_register  # type: ignore[method-assign]
        return spec
