"""``python -m tests.campaigns.stress``: random scenes under random torques."""

import json
import os
from pathlib import Path
from typing import Annotated

import typer

from skate_env.cli.options import (
    MOST_JOBS,
    JsonOption,
    ScenesAccuracyOption,
    ScenesSeedOption,
    fail,
    path,
    value,
)
from skate_env.common import prepare_folder

app = typer.Typer(add_completion=False, pretty_exceptions_enable=False, rich_markup_mode=None)


@app.command()
def stress(
    steps: Annotated[
        int, typer.Option(min=1, max=10**12, help="Least number of actions in total.")
    ] = 100_000,
    seed: ScenesSeedOption = 0,
    accuracy: ScenesAccuracyOption = "balanced",
    jobs: Annotated[
        int | None,
        typer.Option(min=1, max=MOST_JOBS, help="Number of processes; default: one per core."),
    ] = None,
    out: Annotated[
        Path | None, typer.Option(parser=path, help="Folder for table, picture and scenes.")
    ] = None,
    only: Annotated[
        int | None,
        typer.Option("--episode", min=0, max=10**12, help="Only this episode; write its scene."),
    ] = None,
    as_json: JsonOption = False,
) -> None:
    """Simulate random scenes under random torques, and check every action.

    An episode is a random valid scene from its start, for 200 actions of 10 ms or to its end. The
    seed and the number of an episode determine it. The exit status is 1 if a number is not
    finite, an episode ends without a reason, a restored snapshot continues differently, the
    engine panics, an episode takes longer than a minute, or an action needs more than 50 times
    the median number of evaluations of the right-hand side.

    The folder given by --out receives ends.csv, evaluations.png (a histogram of the cost of
    actions) and costliest_*.toml, the scenes with the costliest actions.

    \b
    Ten million actions, the full check:
      python -m tests.campaigns.stress --steps 10_000_000 --out out/stress
    Repeat one episode; its scene goes to out/episode/episode_17.toml:
      python -m tests.campaigns.stress --seed 0 --episode 17 --out out/episode
    """  # noqa: D301 (\b keeps the examples' line breaks)
    from skate_env.common import progress_bar

    from . import campaign, episode, report

    try:
        if out is not None:
            prepare_folder(out)
        if only is not None:
            done = episode.run(seed, only, value(accuracy))
            said, passed = report.episode_summary(done), not done.failures
            typer.echo(report.episode_text(done))
            report.write_episode(seed, only, value(accuracy), out)
        else:
            with progress_bar(steps, "stress", "action") as bar:
                result = campaign.make(
                    seed, steps, value(accuracy), jobs or os.cpu_count() or 1, bar.update
                )
            said, passed = report.summary(result), result.passed
            typer.echo(report.text(result))
            if out is not None:
                report.write(result, out)
    except (ValueError, OSError) as error:
        fail(error)
    if out is not None:
        typer.echo(f"{'written to':<20}{out}")
    if as_json:
        typer.echo(json.dumps(said, allow_nan=False))
    if not passed:
        raise typer.Exit(1)


if __name__ == "__main__":
    app()
