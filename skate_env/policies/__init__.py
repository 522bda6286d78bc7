"""Policies: learned ones, feedback about a periodic orbit, and baselines."""

from . import baseline
from .orbit import OrbitPolicy, inputs, load
from .policy import Policy, shipped

__all__ = ["OrbitPolicy", "Policy", "baseline", "inputs", "load", "shipped"]
