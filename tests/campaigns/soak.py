"""``python -m tests.campaigns.soak``: a long run of vector environments over random scenes."""

import json
import os
from typing import Annotated

import typer

from skate_env.cli.options import (
    MOST_JOBS,
    JsonOption,
    ScenesAccuracyOption,
    ScenesSeedOption,
    fail,
    value,
)

app = typer.Typer(add_completion=False, pretty_exceptions_enable=False, rich_markup_mode=None)


@app.command()
def soak(
    steps: Annotated[
        int, typer.Option(min=1, max=10**12, help="Least number of actions of single environments.")
    ] = 10_000_000,
    seed: ScenesSeedOption = 0,
    accuracy: ScenesAccuracyOption = "fast",
    environments: Annotated[
        int, typer.Option(min=1, max=100_000, help="Environments of a scene.")
    ] = 256,
    threads: Annotated[
        int | None,
        typer.Option(min=1, max=MOST_JOBS, help="Threads of the engine; default: one per core."),
    ] = None,
    as_json: JsonOption = False,
) -> None:
    """Step vector environments of random scenes with random torques for a long time.

    Every scene is drawn as by tests.campaigns.stress. Its environments make 500 actions of 10 ms
    each, or five episodes in the mean; an episode has at most 200 actions. The exit status is 1 if
    an observation or a reward is not finite, or if the resident memory grows by more than 1 % from
    the second quarter of the run to the last; runs of fewer than 500 scenes do not tell.

    \b
    A thousand million actions at fast, an hour or two on two cores:
      python -m tests.campaigns.soak --steps 1_000_000_000
    At the default accuracy, in many small scenes, a quarter of an hour:
      python -m tests.campaigns.soak --steps 10_000_000 --accuracy balanced --environments 16
    """  # noqa: D301 (\b keeps the examples' line breaks)
    from skate_env.common import progress_bar

    from . import soaking as study

    try:
        with progress_bar(steps, "soak", "action") as bar:
            result = study.make(
                seed,
                steps,
                value(accuracy),
                environments,
                threads or os.cpu_count() or 1,
                bar.update,
            )
    except (ValueError, OSError) as error:
        fail(error)
    typer.echo(study.text(result))
    if as_json:
        typer.echo(json.dumps(study.summary(result), allow_nan=False))
    if not result.passed:
        raise typer.Exit(1)


if __name__ == "__main__":
    app()
