"""The command ``skate-env``: replay a scene, list the scenes."""

import json
from enum import Enum
from pathlib import Path
from typing import Annotated, Any, NoReturn

import typer

from . import replay as replaying
from .scenes import load_scene, replace, scene_names

app = typer.Typer(
    help="An ice-skating humanoid, simulated: the system of Zhang et al.",
    no_args_is_help=True,
    add_completion=False,
    pretty_exceptions_enable=False,
    rich_markup_mode=None,
)


class ExtraTorque(str, Enum):
    """Torques of the paper that a scene may leave out."""

    tau8 = "tau8"


@app.command()
def scenes() -> None:
    """List the scenes that come with the package."""
    for name in scene_names():
        fields = json.loads(load_scene(name).to_json())
        typer.echo(f"{name}\n    {fields['description']}\n    from: {fields['provenance']}")


@app.command()
def replay(
    out: Annotated[Path, typer.Option(help="Folder for the results; it is made if need be.")],
    scene: Annotated[str, typer.Option(help="A preset's name, or a .toml file.")] = "paper",
    steps: Annotated[int, typer.Option(min=1, help="How many steps to make.")] = 100,
    perturb: Annotated[
        float, typer.Option(min=0.0, help="Disturb the start: noise of SIGMA rad, rad/s.")
    ] = 0.0,
    seed: Annotated[int, typer.Option(min=0, help="Seed of the disturbance.")] = 0,
    torque: Annotated[
        ExtraTorque | None, typer.Option(help="Add the yaw torque of Eq. 22, 30 N m.")
    ] = None,
    set_: Annotated[
        list[str] | None,
        typer.Option("--set", metavar="NAME=VALUE", help="Change a field; may be repeated."),
    ] = None,
    accuracy: Annotated[
        str | None, typer.Option(help="balanced, reference, or a relative tolerance.")
    ] = None,
    as_json: Annotated[
        bool, typer.Option("--json", help="Print one JSON object on the last line.")
    ] = False,
    no_figures: Annotated[bool, typer.Option("--no-figures", help="Draw nothing.")] = False,
) -> None:
    """Replay a scene's skating; write a table, a recording and the paper's figures.

    The folder given by --out receives steps.csv (one row per step), recording.npz (read it with
    skate_env.recording.Recording.load) and Figs. 5 to 11 as fig05_*.png to fig11_*.png.

    \b
    The paper's 100 steps:
      skate-env replay --scene paper --out out/paper
    From a start disturbed by 1 %, on slower ice, without pictures:
      skate-env replay --perturb 0.01 --seed 3 --set ice.friction.mu_forward=0.3 --no-figures --out out/slow
    With the torque that swings the arms:
      skate-env replay --scene paper_damped --torque tau8 --out out/arms
    A term of the controller switched off, and a machine-readable result:
      skate-env replay --set control.feedforward=null --json --out out/lifting

    A value after --set is JSON (0.3, [1, 2, 3], null, {"amplitude": 10}) or a bare word; an
    unknown name is answered with the known ones.
    """  # noqa: D301 (\b keeps the examples' line breaks)
    try:
        changes = dict(replaying.TAU8) if torque else {}
        changes |= dict(map(_change, set_ or []))
        if accuracy is not None:
            changes["accuracy"] = _value(accuracy)
        chosen = replace(load_scene(scene), changes)
        start = replaying.Start(perturb, seed)
        out.mkdir(parents=True, exist_ok=True)
        recording = replaying.simulate(chosen, steps, start, chosen.name)
        recording.save_steps(out / "steps.csv")
        recording.save(out / "recording.npz")
        if not no_figures:
            replaying.draw(recording, steps, start, out)
    except (ValueError, OSError) as error:
        _fail(error)
    summary = replaying.summarise(recording)
    typer.echo(replaying.summary_text(summary))
    typer.echo(f"{'written to':<20} {out}")
    if as_json:
        typer.echo(json.dumps(summary, allow_nan=False))


def _change(text: str) -> tuple[str, Any]:
    """Split ``NAME=VALUE``."""
    name, equals, value = text.partition("=")
    if not equals:
        raise ValueError(f"--set {text}: write NAME=VALUE, for example ice.friction.mu_forward=0.3")
    return name, _value(value)


def _value(text: str) -> Any:
    """Read a value as JSON; what is not JSON is a bare word."""
    try:
        # NaN and Infinity are words too, so that the scene refuses them by the field's name.
        return json.loads(text, parse_constant=str)
    except json.JSONDecodeError:
        return text


def _fail(error: Exception) -> NoReturn:
    typer.echo(f"error: {error}", err=True)
    raise typer.Exit(2)
