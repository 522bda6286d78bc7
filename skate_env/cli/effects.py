"""The command ``skate-env effects``: what each effect of a scene costs."""

from pathlib import Path
from typing import Annotated

import typer

from ..common import prepare_folder
from .options import JsonOption, SceneOption, echo, fail, path, show


def effects(
    scene: SceneOption = "paper",
    out: Annotated[
        Path | None,
        typer.Option(parser=path, help="Folder for table and chart; created if missing."),
    ] = None,
    quick: Annotated[
        bool, typer.Option("--quick", help="Fewer rounds: less precise times, the same counts.")
    ] = False,
    only_list: Annotated[
        bool, typer.Option("--list", help="Only describe the effects; * marks those in the scene.")
    ] = False,
    as_json: JsonOption = False,
) -> None:
    """Measure what each effect of a scene costs and what it changes.

    The command compares the scene with copies that have one effect added or removed, and with
    some that have several removed. For each it reports the size of the model, evaluations of the
    right-hand side, instructions (needs valgrind), time, MuJoCo's time for the same bodies (needs
    mujoco), and the deviation of the motion. The folder given by --out receives effects.csv,
    effects.png and effects.md, a table for a document.

    \b
    List the effects:
      skate-env effects --list
    The cost of the effects of the paper's scene:
      skate-env effects
    A short run for another scene:
      skate-env effects --scene push_only --quick
    A scene file; table, chart and a machine-readable result:
      skate-env effects --scene mine.toml --json --out out/effects

    Leave the machine otherwise idle. The table states the uncertainty of its times.
    """  # noqa: D301 (\b keeps the examples' line breaks)
    from .._core import EFFECTS
    from ..scenes import load_scene
    from ..studies.effects import report, study

    try:
        chosen = load_scene(scene)
        if only_list:
            for effect, is_on in chosen.effects().items():
                echo(f"{'*' if is_on else ' '} {effect:<22}{EFFECTS[effect]}")
            return
        if out is not None:
            prepare_folder(out)
        table = study.compare(chosen, study.QUICK_ROUNDS if quick else study.ROUNDS)
        if out is not None:
            command = f"skate-env effects --scene {scene}{' --quick' * quick}"
            report.write(table, out, command)
    except (ValueError, OSError) as error:
        fail(error)
    show(report.text(table), out, report.summary(table) if as_json else None)
