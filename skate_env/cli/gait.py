"""The command ``skate-env gait``: the card of a gait."""

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
        typer.Option(parser=path, help="Folder for tables and pictures; created if missing."),
    ] = None,
    as_json: JsonOption = False,
) -> None:
    """Measure a gait: the paper's order of contact states, and what a human could do.

    The card of a gait lists the share of steps in the order 3-7-15-16-14-3, the time in each
    contact state, how the free foot lands and how deep it goes, how far the ice pulls the ends of
    the soles, torques, rates and work, and how many perturbed starts survive, also at the
    accuracies 1e-7 and reference. Every line states its unit; a requirement stands beside it.

    The folder given by --out receives gaits.md (the tables and all definitions), gaits.json (the
    same for programs) and a picture of one step of each scene, gait_*.png: contact states, heights
    of both feet, normal force at each end of the soles.

    \b
    The card of the paper's scene:
      skate-env gait
    Two scenes side by side, with pictures:
      skate-env gait --scene paper --scene mine.toml --out out/gait
    A learned policy:
      skate-env gait --scene push_only --policy shipped --steps 30
    For programs:
      skate-env gait --scene mine.toml --steps 20 --json
    """  # noqa: D301 (\b keeps the examples' line breaks)
    from ..common import progress_bar
    from ..gait import card, report

    cards = []
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
            with progress_bar(card.work(steps, level), name, "run") as bar:
                cards.append(card.measure(chosen, name, steps, level, learned, bar.update))
        if out is not None:
            command = "skate-env gait" + "".join(f" --scene {each}" for each in scene or [])
            command += f" --policy {policy}" if policy else ""
            report.write(cards, out, f"{command} --steps {steps} --accuracy {accuracy}")
    except (ValueError, OSError) as error:
        options.fail(error)
    options.show(report.text(cards), out, report.summary(cards) if as_json else None)
