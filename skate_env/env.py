"""The single environment; an import path of earlier versions, like `vector` and `policy`."""

from .environments import IceSkateEnv

__all__ = ["IceSkateEnv"]
