"""The command ``skate-env replay``: simulation of a scene with statistics and figures."""

import json
from enum import Enum
from importlib.metadata import version
from pathlib import Path
from typing import Annotated

import typer

from ..common import prepare_folder
from . import options
from .options import (
    MOST_STEPS,
    JsonOption,
    PerturbOption,
    PolicyOption,
    SeedOption,
    SkatedOption,
    WithoutOption,
    path,
)

_EXAMPLE = "ice.friction.mu_forward=0.3"


class ExtraTorque(str, Enum):
    """Optional torques of the paper."""

    tau8 = "tau8"


def _verify(file: Path | None) -> None:
    """Repeat the motion of a recording, print the result, and exit; status 1 if it differs."""
    if file is None:
        return
    from ..replay import Recording

    try:
        recording = Recording.load(file)
        found = recording.verify()
    except (ValueError, OSError) as error:
        options.fail(error)
    answer = "yes: the same bits" if found.difference is None else f"no: {found.difference}"
    options.echo(answer)
    options.echo(f"repeated: {found.actions} actions, {found.duration:.2f} s")
    options.echo(
        f"versions: recorded {recording.metadata['version']!r}, now {version('skate-env')!r}"
    )
    if found.difference is None:
        raise typer.Exit
    raise typer.Exit(1)


def replay(
    out: Annotated[
        Path, typer.Option(parser=path, help="Folder for the results; created if missing.")
    ],
    scene: SkatedOption = None,
    policy: PolicyOption = None,
    steps: Annotated[int, typer.Option(min=1, max=MOST_STEPS, help="Number of gait steps.")] = 100,
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
    verify: Annotated[
        Path | None,
        typer.Option(
            parser=path,
            callback=_verify,
            is_eager=True,
            metavar="FILE",
            help="Only repeat the motion of a recording.npz; say if it has the same bits.",
        ),
    ] = None,
    as_json: JsonOption = False,
    no_figures: Annotated[bool, typer.Option("--no-figures", help="Write no figures.")] = False,
    html: Annotated[
        bool,
        typer.Option(
            "--html",
            help="Write recording.html, which plays in a browser; a clone needs `make web` first.",
        ),
    ] = False,
) -> None:
    """Simulate a scene; write a table, a recording and the paper's figures.

    The folder given by --out receives steps.csv (one row per step), recording.npz (read it with
    skate_env.replay.Recording.load) and Figs. 5 to 11 as fig05_*.png to fig11_*.png. With a
    policy, the scene's own controller is simulated from the same start as well: Figs. 7 and 8 show
    the policy, and policy_and_baseline.png compares both.

    \b
    The paper's 100 steps:
      skate-env replay --scene paper --out out/paper
    From a perturbed start, with more friction, without figures:
      skate-env replay --perturb 0.01 --seed 3 --set ice.friction.mu_forward=0.3 --no-figures \\
        --out out/slow
    With the yaw torque tau8 (Eq. 22), which moves the arms:
      skate-env replay --scene paper_arms --torque tau8 --out out/arms
    Arms and head locked, with a stop that keeps the knee from bending backwards:
      skate-env replay --without arms --without head_joint --with knee_stop --out out/still
    Without one term of the controller; a machine-readable result:
      skate-env replay --set control.feedforward=null --json --out out/lifting
    A file that plays in any browser, without a server and without a network:
      skate-env replay --steps 10 --html --no-figures --out out/player
    A learned policy, from a perturbed start:
      skate-env replay --policy policy.npz --steps 30 --perturb 0.01 --out out/learned
    Does a recorded motion have the same bits on this machine?
      skate-env replay --verify out/paper/recording.npz

    --without and --with apply before --set; `skate-env effects --list` lists the effects. A value
    after --set is JSON (0.3, [1, 2, 3], null, {"amplitude": 10}) or a string; for an unknown name
    the error lists the valid names.
    """  # noqa: D301 (\b keeps the examples' line breaks)
    from ..common import files
    from ..replay import page
    from ..replay import replays as replaying
    from ..scenes import replace

    try:
        changes = dict(replaying.TAU8) if torque else {}
        changes |= dict(options.name_and_value(text, _EXAMPLE) for text in set_ or [])
        if accuracy is not None:
            changes["accuracy"] = options.value(accuracy)
        given, learned = options.load_scene_and_policy(scene, policy)
        chosen = given
        for effect in without or []:
            chosen = chosen.without(effect)
        for effect in with_ or []:
            chosen = chosen.with_effect(effect)
        chosen = replace(chosen, changes)
        learned = learned and learned.on(chosen)
        start = replaying.Start(perturb, seed)
        if html:
            page.check_built()
        prepare_folder(out)
        recording = replaying.simulate(chosen, steps, start, chosen.name, learned)
        recording.save_steps(out / "steps.csv")
        recording.save(out / "recording.npz")
        if html:
            files.write_text(out / "recording.html", recording.to_html())
        summary = replaying.summarise(recording)
        if policy is not None:
            baseline = replaying.simulate(chosen, steps, start, "baseline")
            summary["policy"] = options.policy_name(policy, chosen)
            summary["baseline"] = replaying.summarise(baseline)
            if not no_figures:
                replaying.draw_comparison(recording, baseline, out)
        elif not no_figures:
            replaying.draw(recording, steps, start, out)
    except (ValueError, OSError) as error:
        options.fail(error)
    options.echo(replaying.summary_text(summary))
    options.echo(f"{'written to':<20} {out}")
    if as_json:
        options.echo(json.dumps(summary, allow_nan=False))
