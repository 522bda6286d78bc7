"""IceSkate: an ice-skating humanoid, simulated in Rust.

``gymnasium.make("IceSkate-v0")`` makes the environment, ``Simulator("paper")`` its simulator, and
``skate-env replay --scene paper --out out`` replays the paper.

The names of this module are loaded at first use.
"""

from importlib import import_module
from pathlib import Path
from typing import TYPE_CHECKING, Any

from .registration import register_on_import

if TYPE_CHECKING:
    from . import _core, baseline, policy
    from ._core import EFFECTS, Scene
    from .env import IceSkateEnv
    from .mirror import Mirror
    from .mjcf import to_mjcf
    from .policy import Policy
    from .scenes import load_scene, scene_names
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

# Module of each name that is loaded at first use.
_MODULES = {
    "EFFECTS": "_core",
    "IceSkateEnv": "env",
    "IceSkateVectorEnv": "vector",
    "Mirror": "mirror",
    "Policy": "policy",
    "Scene": "_core",
    "load_scene": "scenes",
    "scene_names": "scenes",
    "to_mjcf": "mjcf",
}


def Simulator(scene: "Scene | str | Path" = "paper") -> "_core.Simulator":
    """Make a simulator of a scene: a `Scene`, a preset's name, or the path of a scene file."""
    from . import _core
    from .scenes import as_scene

    return _core.Simulator(as_scene(scene))


def __getattr__(name: str) -> Any:
    """Load a public name or a submodule."""
    if name in _MODULES:
        value = getattr(import_module(f".{_MODULES[name]}", __name__), name)
        globals()[name] = value
        return value
    if name in ("_core", "baseline", "policy"):
        return import_module(f".{name}", __name__)
    raise AttributeError(f"module {__name__!r} has no attribute {name!r}")


def __dir__() -> list[str]:
    """List the names that are not loaded yet as well."""
    return sorted({*globals(), *__all__})


register_on_import()
