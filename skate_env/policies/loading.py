"""Policies from files, and those of the package."""

from collections.abc import Callable
from functools import partial
from pathlib import Path

from ..common import seed_of, shown
from . import archive
from .orbit import OrbitPolicy
from .policy import Policy

_FOLDER = Path(__file__).parent


def load(path: str | Path, seed: int = 0) -> Policy | OrbitPolicy:
    """Read a file of `Policy.save` or of `OrbitPolicy.save`; ``seed`` is that of a network's noise.

    Raises
    ------
    ValueError
        If the file is damaged, of an unknown format, or holds no policy.
    OSError
        If the file cannot be read.
    """
    seed_of(seed)
    makers: dict[str, Callable[..., Policy | OrbitPolicy]] = {
        archive.NETWORK: partial(Policy, seed=seed),
        archive.ORBIT: OrbitPolicy,
    }
    return archive.load(Path(path), makers)


def shipped(scene: str) -> Path:
    """Return the path of the shipped policy of a preset, or of ``any_ice``.

    Raises
    ------
    ValueError
        If there is none; the message names those that exist.
    """
    names = sorted(path.stem for path in _FOLDER.glob("*.npz"))
    if scene not in names:
        known = f"there is one for {', '.join(names)}"
        raise ValueError(f"no policy for the scene {shown(scene)} comes with the package: {known}")
    return _FOLDER / f"{scene}.npz"
