"""The command ``skate-env sensitivity``: how a gait depends on the parameters of its scene."""

from pathlib import Path
from typing import Annotated

import typer

from ..files import prepare_folder
from . import options
from .options import JsonOption, SceneOption, path


def sensitivity(
    scene: SceneOption = "paper",
    steps: Annotated[
        int, typer.Option(min=2, max=100, help="Number of the step that is described.")
    ] = 2,
    accuracy: Annotated[
        str, typer.Option(help="reference, a tolerance of 1e-10 or less, or JSON.")
    ] = "reference",
    out: Annotated[
        Path | None,
        typer.Option(parser=path, help="Folder for table and picture; created if missing."),
    ] = None,
    as_json: JsonOption = False,
) -> None:
    """Rank the parameters of a scene by their effect on its gait.

    The command differentiates slide and period of a step, and the height of the head at its end,
    by every parameter that is not zero: through all impacts, contact changes and swaps of the legs
    from the start to the end of that step. The table has relative changes, with their sign and
    their deviation from differences of the motion. The start stays as it is.

    The folder given by --out receives sensitivity.md, sensitivity.json and sensitivity.png.

    \b
    The second step of the paper's scene:
      skate-env sensitivity
    Another step and scene, with a picture:
      skate-env sensitivity --scene paper_arms --steps 4 --out out/sensitivity
    For programs:
      skate-env sensitivity --scene mine.toml --json
    """  # noqa: D301 (\b keeps the examples' line breaks)
    from ..progress import progress_bar
    from ..scenes import load_scene, replace
    from ..studies.sensitivity import report, study

    try:
        if out is not None:
            prepare_folder(out)
        chosen = replace(load_scene(scene), {"accuracy": options.value(accuracy)})
        with progress_bar(len(study.parameters(chosen)), chosen.name, "parameter") as bar:
            found = study.measure(chosen, steps, bar.update)
        if out is not None:
            command = f"skate-env sensitivity --scene {scene} --steps {steps} --accuracy {accuracy}"
            report.write(found, out, command)
    except (ValueError, OSError) as error:
        options.fail(error)
    options.show(report.text(found), out, report.summary(found) if as_json else None)
