"""The command ``skate-env accuracy``: the error and the time of every integration method."""

from pathlib import Path
from typing import Annotated

import typer

from ..common import prepare_folder
from .options import JsonOption, echo, fail, path, show


def accuracy(
    scene: Annotated[
        list[str] | None,
        typer.Option("--scene", metavar="NAME", help="Only this motion; may be repeated."),
    ] = None,
    quick: Annotated[
        bool, typer.Option("--quick", help="Fewer settings, starts and rounds.")
    ] = False,
    out: Annotated[
        Path | None,
        typer.Option(parser=path, help="Folder for tables and figures; created if missing."),
    ] = None,
    only_list: Annotated[bool, typer.Option("--list", help="Only list the motions.")] = False,
    as_json: JsonOption = False,
) -> None:
    """Measure the error and the time of every integration method at every setting.

    Motions from smooth to stiff are computed by each method of the engine, coarse to fine, and by
    MuJoCo if it is installed. Errors are relative to the engine at its tightest tolerance, which
    SciPy's solvers check if scipy is installed. The folder given by --out receives accuracy.png
    (all motions), accuracy_NAME.png for each motion, accuracy.md (tables for a document),
    accuracy.csv (a row for each motion, method and setting) and accuracy.json (everything, also the
    differences between the references and the long simulations).

    \b
    List the motions:
      skate-env accuracy --list
    A short run, within two minutes:
      skate-env accuracy --quick
    Two motions in full:
      skate-env accuracy --scene slide --scene cycle --out out/accuracy

    Leave the machine otherwise idle. The tables state the uncertainty of the times.
    """  # noqa: D301 (\b keeps the examples' line breaks)
    from ..studies.accuracy import report, settings
    from ..studies.accuracy import study as studies
    from ..studies.motions.cases import cases

    if only_list:
        for case in cases().values():
            echo(f"{case.name:<14}{case.title} ({case.duration:g} s)")
        return
    try:
        if out is not None:
            prepare_folder(out)
        study = studies.make(scene or [], settings.quick() if quick else settings.full())
        if out is not None:
            chosen = "".join(f" --scene {name}" for name in scene or [])
            report.write(study, out, f"skate-env accuracy{chosen}{' --quick' * quick}")
    except (ValueError, OSError) as error:
        fail(error)
    show(report.text(study), out, study.summary() if as_json else None)
