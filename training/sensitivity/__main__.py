"""``python -m training.sensitivity``: how a gait depends on the parameters of its scene."""

from pathlib import Path
from typing import Annotated

import typer

from skate_env.cli import options
from skate_env.cli.options import JsonOption, SceneOption, path
from skate_env.common import prepare_folder

app = typer.Typer(add_completion=False, pretty_exceptions_enable=False, rich_markup_mode=None)


@app.command()
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
      python -m training.sensitivity
    Another step and scene, with a picture:
      python -m training.sensitivity --scene paper_arms --steps 4 --out out/sensitivity
    For programs:
      python -m training.sensitivity --scene mine.toml --json
    """  # noqa: D301 (\b keeps the examples' line breaks)
    from skate_env.common import progress_bar
    from skate_env.scenes import load_scene, replace

    from . import report, study

    try:
        if out is not None:
            prepare_folder(out)
        chosen = replace(load_scene(scene), {"accuracy": options.value(accuracy)})
        with progress_bar(len(study.parameters(chosen)), chosen.name, "parameter") as bar:
            found = study.measure(chosen, steps, bar.update)
        if out is not None:
            command = (
                f"python -m training.sensitivity --scene {scene} --steps {steps} "
                f"--accuracy {accuracy}"
            )
            report.write(found, out, command)
    except (ValueError, OSError) as error:
        options.fail(error)
    options.show(report.text(found), out, report.summary(found) if as_json else None)


if __name__ == "__main__":
    app()
