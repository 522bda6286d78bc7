"""The command ``skate-env record``: a film of a simulation."""

import re
from pathlib import Path
from typing import Annotated

import typer

from . import options
from .options import MOST_STEPS, PerturbOption, PolicyOption, SeedOption, SkatedOption, number, path


def record(
    out: Annotated[
        Path, typer.Option(parser=path, help="File to write; its name ends in .mp4 or .gif.")
    ],
    scene: SkatedOption = None,
    policy: PolicyOption = None,
    compare_baseline: Annotated[
        bool,
        typer.Option("--compare-baseline", help="Show the baseline to the left of the policy."),
    ] = False,
    steps: Annotated[
        int, typer.Option(min=1, max=MOST_STEPS, help="Number of gait steps to film.")
    ] = 3,
    perturb: PerturbOption = 0.0,
    seed: SeedOption = 0,
    slow: Annotated[
        float,
        typer.Option(
            min=0.01, max=1000.0, callback=number, help="Slow motion factor; 1 is real time."
        ),
    ] = 1.0,
    fps: Annotated[
        float,
        typer.Option(
            min=1.0, max=200.0, callback=number, help="Frames per second; at most 50 in a GIF."
        ),
    ] = 50.0,
    size: Annotated[str, typer.Option(metavar="WxH", help="Size in pixels.")] = "960x540",
) -> None:
    """Film a simulation.

    Needs neither a display nor a graphics card. MP4 needs imageio-ffmpeg: pip install
    "skate-env[render]". The film ends after the given number of steps, with a fall, or if 20 s
    pass without a step.

    \b
    Three steps of the paper, in real time:
      skate-env record --scene paper --steps 3 --out film.mp4
    The first step four times slower, as a small GIF:
      skate-env record --steps 1 --slow 4 --fps 25 --size 640x360 --out step.gif
    A fall from a perturbed start with push-only contact:
      skate-env record --scene push_only --steps 20 --perturb 0.01 --seed 3 --out fall.mp4
    A learned policy and the baseline, from the same start:
      skate-env record --policy policy.npz --compare-baseline --steps 10 --out learned.mp4
    """  # noqa: D301 (\b keeps the examples' line breaks)
    from gymnasium.error import DependencyNotInstalled

    from .._core import Simulator
    from ..render import Renderer, SideBySide
    from ..replay import film

    try:
        if compare_baseline and policy is None:
            raise ValueError("--compare-baseline: name a policy with --policy")
        width, height = _size(size)
        given, learned = options.load_scene_and_policy(scene, policy)
        learned = learned and learned.on(given)
        sim = Simulator(given)
        if perturb > 0.0:
            sim.perturb(perturb, seed)
        if learned and compare_baseline:
            stage = SideBySide(width, height, ("baseline", "policy"))
            films = list(film.make_comparison(out, sim, stage, steps, fps, slow, learned))
        else:
            renderer = Renderer(width, height)
            films = [film.make(out, sim, renderer, steps, fps, slow, learned)]
    except (ValueError, OSError, DependencyNotInstalled) as error:
        options.fail(error)
    if policy is not None:
        options.echo(f"{'policy':<20}{options.policy_name(policy, given)}")
    for made, who in zip(reversed(films), ("filmed", "baseline"), strict=False):
        ending = "" if made.termination is None else f", ended by {made.termination}"
        options.echo(f"{who:<20}{made.steps} steps, {made.motion_time:.2f} s{ending}")
    options.echo(f"{'film':<20}{films[0].frames} frames, {films[0].play_time:.2f} s")
    options.echo(f"{'written to':<20}{out}")


def _size(text: str) -> tuple[int, int]:
    match = re.fullmatch(r"(\d{1,6})x(\d{1,6})", text)
    if not match:
        raise ValueError(f"--size {text}: write WIDTHxHEIGHT, for example 960x540")
    return int(match[1]), int(match[2])
