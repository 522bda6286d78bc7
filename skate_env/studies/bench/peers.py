"""The packages that IceSkate is measured against, where they are installed."""

import os
import platform
from importlib import import_module
from importlib.metadata import PackageNotFoundError, version
from typing import Any

from ..effects.report import machine

_NAMES = (
    "skate_env",
    "numpy",
    "gymnasium",
    "mujoco",
    "pin",
    "envpool",
    "stable_baselines3",
    "torch",
)
# What decides how many threads a peer's linear algebra takes.
_THREADS = ("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS", "MKL_NUM_THREADS")


class Missing(Exception):
    """Why a peer cannot be measured here."""


def package(name: str, distribution: str | None = None) -> Any:
    """Import a peer.

    Raises
    ------
    Missing
        If it is not installed, under the name that people install it by.
    """
    try:
        return import_module(name)
    except ImportError:
        raise Missing(f"{distribution or name} is not installed") from None


def tool(name: str, distribution: str) -> str:
    """Name a peer with its version, where it is installed."""
    return f"{name} {found}" if (found := _version(distribution)) else name


def stamp() -> dict[str, str]:
    """Name the machine, and the versions of what the figures depend on."""
    versions = {name: found for name in _NAMES if (found := _version(name))}
    threads = {name: os.environ[name] for name in _THREADS if name in os.environ}
    return {"machine": machine(), "python": platform.python_version(), **versions, **threads}


def _version(name: str) -> str:
    try:
        return version(name)
    except PackageNotFoundError:
        return ""
