"""The command ``skate-env gait``: what a gait does."""

from pathlib import Path
from typing import Annotated

import typer

from ..common import prepare_folder
from . import options
from .options import MOST_STEPS, JsonOption, PolicyOption, path


def gait(
    scene: Annotated[
        list[str] | None,
        typer.Option(
            help="Name of a preset, or a .toml file; may be repeated. Default: the scene of the "
            "policy, or paper.",
            show_default=False,
        ),
    ] = None,
    policy: PolicyOption = None,
    steps: Annotated[int, typer.Option(min=2, max=MOST_STEPS, help="Number of gait steps.")] = 100,
    accuracy: Annotated[
        str, typer.Option(help="fast, balanced, reference, a relative tolerance, or JSON.")
    ] = "balanced",
    out: Annotated[
        Path | None,
        typer.Option(parser=path, help="Folder for numbers and pictures; created if missing."),
    ] = None,
    as_json: JsonOption = False,
) -> None:
    """Measure a gait: contact states, times, lengths, forces and torques.

    Prints the sequences of contact states with their shares of the steps, and a table: share of
    steps in the paper's order 3-7-15-16-14-3, step length and period, time on one foot, on both and
    in the air, largest push and pull of the ice at an end of a sole in body weights, largest
    torques and rates of the joints, time in each contact state. Every line states its unit.

    The folder given by --out receives gaits.json (the same for programs, with the definition of
    each line) and a picture of one step of each scene, gait_*.png: contact states, heights of both
    feet, normal force at each end of the soles.

    \b
    The paper's scene:
      skate-env gait
    Two scenes side by side, with pictures:
      skate-env gait --scene paper --scene mine.toml --out out/gait
    A learned policy:
      skate-env gait --scene push_only --policy shipped --steps 30
    For programs:
      skate-env gait --scene mine.toml --steps 20 --json
    """  # noqa: D301 (\b keeps the examples' line breaks)
    from .._core import Simulator
    from ..common import progress_bar
    from ..gait import Motion, report, skate
    from ..scenes import replace

    motions: dict[str, Motion] = {}
    try:
        if out is not None:
            prepare_folder(out)
        level = options.value(accuracy)
        named: list[str | None] = [*scene] if scene else [None]
        for each in named:
            chosen, learned = options.load_scene_and_policy(each, policy)
            name = chosen.name
            if policy is not None:
                name += f" with {options.policy_name(policy, chosen)}"
            chosen = replace(chosen, {"accuracy": level})
            with progress_bar(steps, name, "step") as bar:
                added = learned and learned.on(chosen)
                motions[name] = skate(Simulator(chosen), steps, added, bar.update)
        if out is not None:
            report.write(motions, out)
    except (ValueError, OSError) as error:
        options.fail(error)
    options.show(report.text(motions), out, report.summary(motions) if as_json else None)
