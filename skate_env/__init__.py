"""IceSkate: an ice-skating humanoid, simulated in Rust.

``gymnasium.make("skate_env:IceSkate-v0")`` makes the environment, ``Simulator("paper")`` the
simulator beneath it, and ``skate-env replay --scene paper --out out`` replays the paper.
"""

from pathlib import Path

import gymnasium

from . import _core, baseline, policy
from ._core import EFFECTS, Scene
from .env import IceSkateEnv
from .mirror import Mirror
from .mjcf import to_mjcf
from .policy import Policy
from .scenes import as_scene, load_scene, scene_names
from .vector import IceSkateVectorEnv

__all__ = [
    "EFFECTS",
    "IceSkateEnv",
    "IceSkateVectorEnv",
    "Mirror",
    "Policy",
    "Scene",
    "Simulator",
    "baseline",
    "load_scene",
    "policy",
    "scene_names",
    "to_mjcf",
]


def Simulator(scene: Scene | str | Path = "paper") -> _core.Simulator:
    """Make a simulator of a scene, which may be given by a preset's name or a file's path."""
    return _core.Simulator(as_scene(scene))


gymnasium.register(
    id="IceSkate-v0",
    entry_point="skate_env.env:IceSkateEnv",
    vector_entry_point="skate_env.vector:IceSkateVectorEnv",
    max_episode_steps=3000,
)
