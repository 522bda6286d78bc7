"""``python -m tests.bench``: IceSkate compared with other simulators."""

from pathlib import Path
from typing import Annotated

import typer

from skate_env.cli.options import JsonOption, fail, path, show
from skate_env.common import prepare_folder

app = typer.Typer(add_completion=False, pretty_exceptions_enable=False, rich_markup_mode=None)


@app.command()
def bench(
    out: Annotated[
        Path | None,
        typer.Option(parser=path, help="Folder for table, JSON and picture; created if missing."),
    ] = None,
    quick: Annotated[
        bool,
        typer.Option(
            "--quick", help="Few rounds and small batches; no environments at equal error."
        ),
    ] = False,
    as_json: JsonOption = False,
) -> None:
    """Measure the speed of IceSkate and of other simulators, in one run.

    The right-hand side in every contact state against MuJoCo's mj_forward and Pinocchio's aba; a
    step of `fast` against mj_step at the same step size; environment steps per second against a
    MuJoCo environment of the same robot, also at equal errors, mujoco.rollout and Gymnasium's
    Humanoid-v5; landings and flights against Drake's CENIC; scaling with environments, threads and
    degrees of freedom; resets and snapshots; derivatives.

    A library that is not installed is reported as missing. The folder given by --out receives
    performance.md (tables for a document), performance.json and performance.png.

    \b
    Everything, within ten minutes:
      python -m tests.bench --out out/bench
    A short run, within one minute:
      python -m tests.bench --quick
    For a program:
      python -m tests.bench --quick --json | tail -n 1

    Leave the machine otherwise idle. Blocks of one table are timed alternately under the same
    load: use the ratios, and compare times of one run only.
    """  # noqa: D301 (\b keeps the examples' line breaks)
    from . import report, sizes, suite

    try:
        if out is not None:
            prepare_folder(out)
        made = suite.run(sizes.quick() if quick else sizes.full())
        if out is not None:
            report.write(made, out, f"python -m tests.bench{' --quick' * quick}")
    except (ValueError, OSError) as error:
        fail(error)
    show(report.text(made), out, made.summary() if as_json else None)


if __name__ == "__main__":
    app()
