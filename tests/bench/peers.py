"""Optional packages that IceSkate is compared with."""

from importlib import import_module
from typing import Any

from skate_env.studies.report import installed_version


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
