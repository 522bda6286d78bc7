"""Optional packages that IceSkate is compared with."""

import os
import platform
from importlib import import_module
from typing import Any

from skate_env.studies.versions import installed_version, machine

_NAMES = ("skate_env", "numpy", "gymnasium", "mujoco", "pin")
# Environment variables that set the number of threads of linear algebra.
_THREADS = ("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS", "MKL_NUM_THREADS")


class Unavailable(Exception):
    """A package or state that a measurement needs is not available."""


def package(name: str, distribution: str | None = None) -> Any:
    """Import an optional package.

    Raises
    ------
    Unavailable
        If it is not installed; the message names the distribution.
    """
    try:
        return import_module(name)
    except ImportError:
        raise Unavailable(f"{distribution or name} is not installed") from None


def tool(name: str, distribution: str) -> str:
    """Return a package's name with its version if it is installed."""
    return f"{name} {found}" if (found := installed_version(distribution)) else name


def stamp() -> dict[str, str]:
    """Return the machine, versions and thread settings that determine the results."""
    versions = {name: found for name in _NAMES if (found := installed_version(name))}
    threads = {name: os.environ[name] for name in _THREADS if name in os.environ}
    return {"machine": machine(), "python": platform.python_version(), **versions, **threads}
