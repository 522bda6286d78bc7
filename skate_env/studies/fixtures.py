"""Scenes that studies and tests use and that are no presets: paths of their files."""

from pathlib import Path

_FOLDER = Path(__file__).with_name("scenes")
BLADE = str(_FOLDER / "blade.toml")
PAPER_DAMPED = str(_FOLDER / "paper_damped.toml")


def name_of(scene: str) -> str:
    """Return the name of a preset or of a scene's file, for tables."""
    return Path(scene).stem
