"""The command ``skate-env bench``: IceSkate and its peers side by side."""

import json
from pathlib import Path
from typing import Annotated

import typer

from .bench import extent, report, suite


def bench(
    out: Annotated[
        Path | None, typer.Option(help="Folder for table, JSON and picture; it is made if need be.")
    ] = None,
    quick: Annotated[
        bool, typer.Option("--quick", help="Few rounds and small batches; nothing at equal errors.")
    ] = False,
    as_json: Annotated[
        bool, typer.Option("--json", help="Print one JSON object on the last line.")
    ] = False,
) -> None:
    """Measure IceSkate and its peers side by side, in one run.

    The right-hand side in every contact state against MuJoCo's mj_forward and Pinocchio's aba; a
    step of `fast` against mj_step at the same step size, and both at equal errors; environment
    steps a second against an environment of the same body in MuJoCo, mujoco.rollout, Gymnasium's
    Humanoid-v5 and envpool; growth with environments, threads and degrees of freedom; resets and
    snapshots; and PPO of Stable-Baselines3 against PPO on environments that cost nothing. At the
    end stands what the engine is to reach, and whether it does in this run.

    A peer that is not installed is said to be missing. The folder given by --out receives
    performance.md (tables for a document), performance.json and performance.png.

    \b
    Everything, within ten minutes:
      skate-env bench --out out/bench
    A first look, within one:
      skate-env bench --quick
    For a program:
      skate-env bench --quick --json | tail -n 1

    Leave the machine alone meanwhile. What takes its turn in one table sees the same machine: trust
    the ratios, and compare times of one run only.
    """  # noqa: D301 (\b keeps the examples' line breaks)
    try:
        if out is not None:
            out.mkdir(parents=True, exist_ok=True)
        made = suite.run(extent.quick() if quick else extent.full())
        if out is not None:
            report.write(made, out, f"skate-env bench{' --quick' * quick}")
    except (ValueError, OSError) as error:
        typer.echo(f"error: {error}", err=True)
        raise typer.Exit(2) from None
    typer.echo(report.text(made))
    if out is not None:
        typer.echo(f"written to {out}")
    if as_json:
        typer.echo(json.dumps(report.summary(made), allow_nan=False))
