"""Scenes: presets (the ``.toml`` files here), scene files, changed copies, MJCF, mirrors."""

from .loading import SceneSource, as_scene, load_scene, replace, scene_names
from .mirror import Mirror
from .mjcf import to_mjcf

__all__ = ["Mirror", "SceneSource", "as_scene", "load_scene", "replace", "scene_names", "to_mjcf"]
