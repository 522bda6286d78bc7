"""``IceSkateAnyIce-v0``: bodies and ice that differ in every episode."""

from typing import Any

from .._core import Scene
from ..scenes import SceneSource, as_scene, replace
from .single import IceSkateEnv
from .vector import IceSkateVectorEnv

# Forward friction coefficient, and factors of every mass and every length of the body.
FRICTION = (0.05, 0.4)
MASS = (0.75, 1.25)
LENGTH = (0.95, 1.05)


def any_ice_scene(scene: SceneSource = "push_only") -> Scene:
    """Return a scene that draws friction, masses and lengths uniformly in every episode.

    Raises
    ------
    ValueError, OSError
        As for `as_scene`.
    """
    scene = as_scene(scene)
    ranges = {"ice.friction.mu_forward": list(FRICTION)}
    for name, (value, *_) in scene.parameters().items():
        part, _, quantity = name.rpartition(".")
        factors = {"mass": MASS, "length": LENGTH}.get(quantity)
        if part.startswith("body.") and factors:
            ranges[name] = [factor * value for factor in factors]
    return replace(scene, {"randomise": ranges | scene.get("randomise")})


def any_ice(scene: SceneSource = "push_only", **keywords: Any) -> IceSkateEnv:
    """Make `IceSkateEnv` in `any_ice_scene`; the same keywords."""
    return IceSkateEnv(any_ice_scene(scene), **keywords)


def any_ice_vector(
    num_envs: int = 1, scene: SceneSource = "push_only", **keywords: Any
) -> IceSkateVectorEnv:
    """Make `IceSkateVectorEnv` in `any_ice_scene`; the same keywords."""
    return IceSkateVectorEnv(num_envs, any_ice_scene(scene), **keywords)
