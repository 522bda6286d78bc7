"""The command ``skate-env replay``: a scene's skating, in numbers and figures."""

import json
from collections.abc import Sequence
from enum import Enum
from pathlib import Path
from typing import Annotated

import typer

from . import options
from . import replay as replaying
from ._core import Scene
from .options import (
    JsonOption,
    PerturbOption,
    PolicyOption,
    SeedOption,
    SkatedOption,
    WithoutOption,
)
from .scenes import replace

_EXAMPLE = "ice.friction.mu_forward=0.3"


class ExtraTorque(str, Enum):
    """Torques of the paper that a scene may leave out."""

    tau8 = "tau8"


def replay(
    out: Annotated[Path, typer.Option(help="Folder for the results; it is made if need be.")],
    scene: SkatedOption = None,
    policy: PolicyOption = None,
    steps: Annotated[int, typer.Option(min=1, help="How many steps to make.")] = 100,
    perturb: PerturbOption = 0.0,
    seed: SeedOption = 0,
    torque: Annotated[
        ExtraTorque | None, typer.Option(help="Add the yaw torque of Eq. 22, 30 N m.")
    ] = None,
    without: WithoutOption = None,
    with_: Annotated[
        list[str] | None,
        typer.Option("--with", metavar="EFFECT", help="Add an effect; may be repeated."),
    ] = None,
    set_: Annotated[
        list[str] | None,
        typer.Option("--set", metavar="NAME=VALUE", help="Change a field; may be repeated."),
    ] = None,
    accuracy: Annotated[
        str | None,
        typer.Option(
            help="fast, balanced, reference, a relative tolerance, or a method as JSON, as in "
            """'{"method": "rk4", "step": 0.001}'."""
        ),
    ] = None,
    as_json: JsonOption = False,
    no_figures: Annotated[bool, typer.Option("--no-figures", help="Draw nothing.")] = False,
) -> None:
    """Replay a scene's skating; write a table, a recording and the paper's figures.

    The folder given by --out receives steps.csv (one row per step), recording.npz (read it with
    skate_env.recording.Recording.load) and Figs. 5 to 11 as fig05_*.png to fig11_*.png. With a
    policy the same start is skated by the scene's own controller as well: Figs. 7 and 8 are the
    policy's, and policy_beside_baseline.png shows both.

    \b
    The paper's 100 steps:
      skate-env replay --scene paper --out out/paper
    From a start disturbed by 1 %, on slower ice, without pictures:
      skate-env replay --perturb 0.01 --seed 3 --set ice.friction.mu_forward=0.3 --no-figures \\
        --out out/slow
    With the torque that swings the arms:
      skate-env replay --scene paper_damped --torque tau8 --out out/arms
    Arms and head held still, helped by a knee that does not bend backwards:
      skate-env replay --without arms --without head_joint --with knee_stop --out out/still
    A term of the controller switched off, and a machine-readable result:
      skate-env replay --set control.feedforward=null --json --out out/lifting
    What a policy has learned, from a disturbed start:
      skate-env replay --policy policy.npz --steps 30 --perturb 0.01 --out out/learned

    Effects are switched before --set applies; `skate-env effects --list` names them. A value
    after --set is JSON (0.3, [1, 2, 3], null, {"amplitude": 10}) or a bare word; an unknown name
    is answered with the known ones.
    """  # noqa: D301 (\b keeps the examples' line breaks)
    try:
        changes = dict(replaying.TAU8) if torque else {}
        changes |= dict(options.name_and_value(text, _EXAMPLE) for text in set_ or [])
        if accuracy is not None:
            changes["accuracy"] = options.value(accuracy)
        given, learned = options.skated(scene, policy)
        chosen = replace(_switched(given, without or [], with_ or []), changes)
        learned = learned and learned.on(chosen)
        start = replaying.Start(perturb, seed)
        out.mkdir(parents=True, exist_ok=True)
        recording = replaying.simulate(chosen, steps, start, chosen.name, learned)
        recording.save_steps(out / "steps.csv")
        recording.save(out / "recording.npz")
        summary = replaying.summarise(recording)
        if policy is not None:
            baseline = replaying.simulate(chosen, steps, start, "baseline")
            summary["policy"] = options.policy_name(policy, chosen)
            summary["baseline"] = replaying.summarise(baseline)
            if not no_figures:
                replaying.draw_beside(recording, baseline, out)
        elif not no_figures:
            replaying.draw(recording, steps, start, out)
    except (ValueError, OSError) as error:
        options.fail(error)
    typer.echo(replaying.summary_text(summary))
    typer.echo(f"{'written to':<20} {out}")
    if as_json:
        typer.echo(json.dumps(summary, allow_nan=False))


def _switched(scene: Scene, without: Sequence[str], added: Sequence[str]) -> Scene:
    """Copy a scene with effects left out, then others added."""
    for effect in without:
        scene = scene.without(effect)
    for effect in added:
        scene = scene.with_effect(effect)
    return scene
