"""The command ``skate-env hardcases``: situations where naive simulators fail."""

from pathlib import Path
from typing import Annotated

import typer

from ..common import prepare_folder
from .options import JsonOption, fail, path, show


def hardcases(
    case: Annotated[
        list[str] | None,
        typer.Option("--case", metavar="NAME", help="Only this case; may be repeated."),
    ] = None,
    method: Annotated[
        list[str] | None,
        typer.Option(
            "--method",
            metavar="NAME",
            help="balanced, reference, fast, rosenbrock, rk4, or all; may be repeated. Default: "
            "the first three.",
        ),
    ] = None,
    out: Annotated[
        Path | None,
        typer.Option(parser=path, help="Folder for tables and picture; created if missing."),
    ] = None,
    only_list: Annotated[bool, typer.Option("--list", help="Only list the cases.")] = False,
    as_json: JsonOption = False,
) -> None:
    """Run the hard cases and report the margin of each to its limit.

    A case sets the robot up where a simple simulator fails: contact forces that do not exist or
    are not unique, friction at rest, infinitely many impacts, values near zero. It measures the
    deviation from a law of mechanics and passes if that is at most a limit. The margin is the
    limit divided by the measured deviation: 1 just passes, `exact` stands for a deviation of 0.
    The cost is that of a simulated second in evaluations of the right-hand side, divided by that
    of the paper's gait; unlike a time, it is reproducible.

    The exit status is 1 if any case fails. The folder given by --out receives hard-cases.png (all
    margins), hard-cases.md (every case in full, for a document) and hard-cases.csv (a row for
    each case and method).

    \b
    List the cases:
      skate-env hardcases --list
    All cases at the named accuracies:
      skate-env hardcases
    Two cases with every method:
      skate-env hardcases --case painleve_heel --case rattling_sole --method all
    Everything, for the documentation:
      skate-env hardcases --method all --out out/hardcases

    A method that does not support a case is not run on it; the notes below the table say why.
    """  # noqa: D301 (\b keeps the examples' line breaks)
    from ..studies.hardcases import report, runner
    from ..studies.hardcases.catalogue import CASES

    if only_list:
        typer.echo(report.listing(list(CASES.values())))
        return
    try:
        if out is not None:
            prepare_folder(out)
        done = runner.run(case or [], method or [])
        if out is not None:
            chosen = "".join(f" --case {name}" for name in case or [])
            chosen += "".join(f" --method {name}" for name in method or [])
            report.write(done, out, f"skate-env hardcases{chosen}")
    except (ValueError, OSError) as error:
        fail(error)
    show(report.text(done), out, report.summary(done) if as_json else None)
    if not done.passed:
        raise typer.Exit(1)
