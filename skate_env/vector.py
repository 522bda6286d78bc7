"""The vector environment."""

from .environments import IceSkateVectorEnv

__all__ = ["IceSkateVectorEnv"]
