"""IceSkate: an ice-skating humanoid, simulated in Rust.

``gymnasium.make("IceSkate-v0")`` makes the environment, ``Simulator("paper")`` its simulator, and
``skate-env replay --scene paper --out out`` replays the paper.

The names of this module are loaded at first use.
"""

from importlib import import_module
from typing import TYPE_CHECKING, Any

from .registration import register

if TYPE_CHECKING:
    from . import _core
    from ._core import EFFECTS, Linearization, Scene
    from .environments import IceSkateEnv, IceSkateVectorEnv
    from .policies import Policy, baseline
    from .replay import Recording
    from .scenes import Mirror, SceneSource, load_scene, scene_names, to_mjcf

__all__ = [
    "EFFECTS",
    "IceSkateEnv",
    "IceSkateVectorEnv",
    "Linearization",
    "Mirror",
    "Policy",
    "Recording",
    "Scene",
    "Simulator",
    "baseline",
    "load_scene",
    "scene_names",
    "to_mjcf",
]

__version__: str
# Module of each name that is loaded at first use.
_MODULES = {
    "EFFECTS": "_core",
    "IceSkateEnv": "environments",
    "IceSkateVectorEnv": "environments",
    "Linearization": "_core",
    "Mirror": "scenes",
    "Policy": "policies",
    "Recording": "replay",
    "Scene": "_core",
    "baseline": "policies",
    "load_scene": "scenes",
    "scene_names": "scenes",
    "to_mjcf": "scenes",
}


def Simulator(scene: "SceneSource" = "paper") -> "_core.Simulator":
    """Make a simulator of a scene: a `Scene`, a preset's name, a file's path, or a table.

    Examples
    --------
    >>> import skate_env
    >>> sim = skate_env.Simulator("push_only")
    >>> sim.advance(0.1), sim.state_name
    (True, 'slide_flat/air')
    """
    from . import _core
    from .scenes import as_scene

    return _core.Simulator(as_scene(scene))


def __getattr__(name: str) -> Any:
    """Load a public name or a submodule."""
    if name in _MODULES:
        value = getattr(import_module(f".{_MODULES[name]}", __name__), name)
        globals()[name] = value
        return value
    if name == "__version__":
        from importlib.metadata import version

        return version("skate-env")
    if name in ("_core", "policies", "policy", "replay", "scenes"):
        return import_module(f".{name}", __name__)
    raise AttributeError(f"module {__name__!r} has no attribute {name!r}")


def __dir__() -> list[str]:
    """List the names that are not loaded yet as well."""
    return sorted({*globals(), *__all__})


register()
