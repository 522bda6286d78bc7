"""Options that several commands share, and what they mean."""

import json
from pathlib import Path
from typing import Annotated, Any, NoReturn

import typer

from ._core import Scene
from .policy import Policy, shipped
from .scenes import load_scene

SceneOption = Annotated[str, typer.Option(help="A preset's name, or a .toml file.")]
SkatedOption = Annotated[
    str | None,
    typer.Option(
        help="A preset's name, or a .toml file; without it the policy's own, or paper.",
        show_default=False,
    ),
]
PolicyOption = Annotated[
    str | None,
    typer.Option(
        metavar="FILE|shipped",
        help="Let a learned policy act: a file, or the one that the package has for --scene.",
    ),
]
WithoutOption = Annotated[
    list[str] | None,
    typer.Option("--without", metavar="EFFECT", help="Leave an effect out; may be repeated."),
]
PerturbOption = Annotated[
    float, typer.Option(min=0.0, help="Disturb the start: noise of SIGMA rad, rad/s.")
]
SeedOption = Annotated[int, typer.Option(min=0, help="Seed of the disturbance.")]
JsonOption = Annotated[bool, typer.Option("--json", help="Print one JSON object on the last line.")]

_SHIPPED = "shipped"


def skated(scene: str | None, policy: str | None) -> tuple[Scene, Policy | None]:
    """Load what `SkatedOption` and `PolicyOption` name; the policy may be for another scene.

    Raises
    ------
    ValueError, OSError
        As of `load_scene`, `Policy.load` and `shipped`.
    """
    if policy is None:
        return load_scene("paper" if scene is None else scene), None
    if policy != _SHIPPED:
        learned = Policy.load(policy)
    elif scene is None:
        raise ValueError(f"--policy {_SHIPPED}: say which one with --scene")
    else:
        learned = Policy.load(shipped(scene))
    return (learned.scene if scene is None else load_scene(scene)), learned


def policy_name(policy: str, scene: Scene) -> str:
    """Say in a few words which policy acts."""
    return f"the shipped one of {scene.name}" if policy == _SHIPPED else Path(policy).name


def value(text: str) -> Any:
    """Read a value as JSON; what is not JSON is a bare word."""
    try:
        # NaN and Infinity are words too, so that the scene refuses them by the field's name.
        return json.loads(text, parse_constant=str)
    except json.JSONDecodeError:
        return text


def name_and_value(text: str, example: str) -> tuple[str, Any]:
    """Split what follows --set; ValueError, which shows an example, where there is no ``=``."""
    name, equals, given = text.partition("=")
    if not equals:
        raise ValueError(f"--set {text}: write NAME=VALUE, for example {example}")
    return name, value(given)


def fail(error: Exception) -> NoReturn:
    """Say what went wrong, and leave with exit code 2."""
    typer.echo(f"error: {error}", err=True)
    raise typer.Exit(2) from None
