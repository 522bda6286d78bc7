"""Options shared by several commands, and conversion of their values."""

import json
import math
from collections.abc import Iterable, Iterator
from contextlib import contextmanager
from glob import glob
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any, NoReturn

import typer

from ..common import printable, unique

if TYPE_CHECKING:
    from .._core import Scene
    from ..policies import OrbitPolicy, Policy

SceneOption = Annotated[str, typer.Option(help="Name of a preset, or a .toml file.")]
SkatedOption = Annotated[
    str | None,
    typer.Option(
        help="Name of a preset, or a .toml file; default: the scene of the policy, or paper.",
        show_default=False,
    ),
]
PolicyOption = Annotated[
    str | None,
    typer.Option(
        metavar="FILE|shipped",
        help="Add a policy: a file, or the learned one shipped with the package for --scene.",
    ),
]
WithoutOption = Annotated[
    list[str] | None,
    typer.Option("--without", metavar="EFFECT", help="Remove an effect; may be repeated."),
]
# Largest number of gait steps, episodes or processes, and largest seed.
MOST_STEPS, MOST_EPISODES, MOST_JOBS, LAST_SEED = 1_000_000, 1_000_000, 1024, 2**64 - 1


def path(text: str) -> Path:
    """Convert the text of an option that is a path; `Path` takes an empty text as a folder."""
    if not text:
        raise typer.BadParameter("must not be empty")
    return Path(text)


def number(x: float) -> float:
    """Refuse NaN, which no range excludes."""
    if math.isnan(x):
        raise typer.BadParameter("must be a number")
    return x


PerturbOption = Annotated[
    float,
    typer.Option(
        min=0.0,
        max=10.0,
        callback=number,
        help="Standard deviation of the noise on the start [rad, rad/s].",
    ),
]
SeedOption = Annotated[int, typer.Option(min=0, max=LAST_SEED, help="Seed of the perturbation.")]
ScenesSeedOption = Annotated[
    int, typer.Option(min=0, max=LAST_SEED, help="Seed of scenes and torques.")
]
ScenesAccuracyOption = Annotated[
    str, typer.Option(help="Accuracy of all scenes: a name, a tolerance, or JSON, as for replay.")
]
JsonOption = Annotated[bool, typer.Option("--json", help="Print one JSON object on the last line.")]

SHIPPED = "shipped"


def load_scene_and_policy(
    scene: str | None, policy: str | None
) -> "tuple[Scene, Policy | OrbitPolicy | None]":
    """Load what `SkatedOption` and `PolicyOption` name; the policy may be for another scene.

    Raises
    ------
    ValueError, OSError
        As in `load_scene`, `policies.load` and `shipped`.
    """
    from ..policies import load, shipped
    from ..scenes import load_scene

    name = "paper" if scene is None else scene
    if policy is None:
        return load_scene(name), None
    learned = load(shipped(name) if policy == SHIPPED else policy)
    return (learned.scene if scene is None else load_scene(scene)), learned


def policy_name(policy: str, scene: "Scene") -> str:
    """Return the name of the policy for summaries and pictures, also of a path that is no text."""
    return f"the shipped one of {scene.name}" if policy == SHIPPED else printable(Path(policy).name)


def value(text: str) -> Any:
    """Read a value as JSON; anything else is a string.

    Raises
    ------
    ValueError
        If it is nested too deeply, an integer has too many digits, or a name occurs twice.
    """
    try:
        # NaN and Infinity become strings, so that the scene's error names the field.
        return json.loads(text, parse_constant=str, object_pairs_hook=unique)
    except json.JSONDecodeError:
        return text
    except RecursionError:
        raise ValueError(f"{text[:40]}...: nested too deeply") from None
    except ValueError as error:
        raise ValueError(f"{text[:40]}...: {error}") from None


def name_and_value(text: str, example: str) -> tuple[str, Any]:
    """Split the argument of --set; raise ValueError with an example if there is no ``=``."""
    name, equals, given = text.partition("=")
    if not equals:
        raise ValueError(f"--set {text}: write NAME=VALUE, for example {example}")
    return name, value(given)


def fail(error: Exception) -> NoReturn:
    """Print the error, and exit with status 2; a closed pipe is no error."""
    if isinstance(error, BrokenPipeError):
        raise error
    echo(f"error: {error}", err=True)
    raise typer.Exit(2) from None


def echo(text: str, err: bool = False) -> None:
    """Print a text, parts of which may be a stranger's, as the names in a scene file."""
    typer.echo(printable(text), err=err)


def show(text: str, out: Path | None, summary: dict[str, Any] | None) -> None:
    """Print what a study found, the folder it was written to, and the summary as JSON."""
    echo(text)
    if out is not None:
        echo(f"written to {out}")
    if summary is not None:
        echo(json.dumps(summary, allow_nan=False))


def named_paths(option: str, entries: Iterable[str]) -> dict[str, list[Path]]:
    """Split entries ``NAME=FILES`` into names and existing paths, sorted; * matches many.

    Raises
    ------
    ValueError
        If ``=`` is missing, no path exists, or a name is repeated or no heading of a table; the
        message names the option.
    """
    found: dict[str, list[Path]] = {}
    for entry in entries:
        name, equals, pattern = entry.partition("=")
        paths = [Path(path) for path in sorted(glob(pattern))]
        if not equals or not paths:
            raise ValueError(f"{option} {entry}: write NAME=FILES; at least one file must exist")
        if not name.strip() or not name.isprintable() or "|" in name:
            raise ValueError(f"{option} {entry!r}: the name must be printable text without |")
        if name in found:
            raise ValueError(f"{option} {entry}: the name {name!r} is repeated")
        found[name] = paths
    return found


@contextmanager
def requires(extra: str) -> Iterator[None]:
    """Import optional libraries; if one is missing, name the extra to install and exit."""
    try:
        yield
    except ModuleNotFoundError as error:
        missing = (error.name or "").partition(".")[0]
        if missing in ("", "skate_env"):
            raise
        fail(ModuleNotFoundError(f'{missing} is not installed: pip install "skate-env[{extra}]"'))
