"""What commands are given as ``NAME=FILES``, where * stands for many."""

from glob import glob
from pathlib import Path


def named_paths(option: str, entry: str) -> tuple[str, list[Path]]:
    """Split what follows an option into a name and the paths that are there, sorted.

    Raises
    ------
    ValueError
        If it is written otherwise, or nothing is there; it names the option.
    """
    name, equals, pattern = entry.partition("=")
    paths = [Path(path) for path in sorted(glob(pattern))]
    if not equals or not paths:
        raise ValueError(f"{option} {entry}: write NAME=FILES; there must be at least one")
    return name, paths
