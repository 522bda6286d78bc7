"""Learned policies."""

from .policies import Policy, shipped

__all__ = ["Policy", "shipped"]
