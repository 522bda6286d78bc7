"""The machine and the package versions that results depend on."""

import os
import platform
from collections.abc import Iterable, Mapping
from importlib.metadata import PackageNotFoundError, version
from pathlib import Path


def machine() -> str:
    """Return the name of the processor and its number of cores."""
    name = platform.processor() or platform.machine()
    try:
        for line in Path("/proc/cpuinfo").read_text(encoding="utf-8").splitlines():
            if line.startswith("model name"):
                name = line.partition(":")[2].strip()
                break
    except OSError:
        pass
    return f"{name}, {os.cpu_count()} cores"


def installed_version(name: str) -> str:
    """Return the version of a distribution, or an empty string if it is not installed."""
    try:
        return version(name)
    except PackageNotFoundError:
        return ""


def stamp(packages: Iterable[str]) -> dict[str, str]:
    """Return the machine and the versions of Python and packages; empty where not installed."""
    versions = {name: installed_version(name) for name in packages}
    return {"machine": machine(), "python": platform.python_version(), **versions}


def described(stamp: Mapping[str, str]) -> str:
    """Format a stamp, without packages that are not installed."""
    return ", ".join(f"{name} {value}" for name, value in stamp.items() if value)
