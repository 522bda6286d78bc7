"""Policies: learned ones, feedback about a periodic orbit, and baselines; files of both."""

from . import baseline
from .archive import inputs
from .loading import load, shipped
from .orbit import OrbitPolicy
from .policy import Policy

__all__ = ["OrbitPolicy", "Policy", "baseline", "inputs", "load", "shipped"]
