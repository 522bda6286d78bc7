"""The command ``skate-env evaluate``: controllers compared over perturbed starts."""

from pathlib import Path
from typing import Annotated

import typer

from ..common import prepare_folder
from .options import (
    MOST_EPISODES,
    MOST_STEPS,
    SHIPPED,
    PerturbOption,
    SceneOption,
    ScenesAccuracyOption,
    echo,
    fail,
    named_paths,
    number,
    path,
    requires,
    value,
)


def evaluate(
    out: Annotated[
        Path, typer.Option(parser=path, help="Folder for the table; created if missing.")
    ],
    scene: SceneOption = "push_only",
    policy: Annotated[
        list[str] | None,
        typer.Option(
            metavar="NAME=FILES|shipped",
            help="A policy, or with * those of several training seeds, or the one shipped with the "
            "package for --scene; may be repeated.",
        ),
    ] = None,
    episodes: Annotated[
        int, typer.Option(min=1, max=MOST_EPISODES, help="Episodes of each controller.")
    ] = 256,
    steps: Annotated[
        int, typer.Option(min=1, max=MOST_STEPS, help="Gait steps of a complete episode.")
    ] = 100,
    perturb: PerturbOption = 0.02,
    trunk_noise: Annotated[
        float,
        typer.Option(
            min=0.0, max=1.0, callback=number, help="Noise on yaw and roll of the trunk [rad]."
        ),
    ] = 0.01,
    kick: Annotated[
        float,
        typer.Option(
            min=0.0, max=10.0, callback=number, help="Velocity change of random kicks [m/s]."
        ),
    ] = 0.0,
    accuracy: ScenesAccuracyOption = "balanced",
) -> None:
    """Compare controllers over perturbed starts.

    All controllers have the same starts and the same kicks, none of which occur in training. The
    baseline and its lifting alone are always included. The table shows interquartile means with
    95 % bootstrap intervals, stratified by start (Agarwal et al. 2021); completed episodes and
    falls are shares of all episodes with Wilson's intervals of 95 %. Needs SciPy: pip install
    "skate-env[train]". The folder receives evaluation.md and evaluation.json (every episode).

    \b
    The baseline, and the shipped policy, with random kicks of 0.6 m/s:
      skate-env evaluate --scene push_only --policy shipped --kick 0.6 --out out/evaluation
    Several training seeds, compared with learning from scratch:
      skate-env evaluate --policy 'residual=out/push_only/*/policy.npz' \\
        --policy 'scratch=out/scratch/*/policy.npz' --out out/evaluation
    """  # noqa: D301 (\b keeps the examples' line breaks)
    with requires("train"):
        from ..learning import evaluation
    from ..learning.rollouts import Conditions
    from ..policies import shipped

    try:
        conditions = Conditions(
            episodes=episodes,
            steps=steps,
            disturbances={"perturb": perturb, "trunk_noise": trunk_noise, "kick": kick},
            accuracy=value(accuracy),
        )
        given = [f"shipped={shipped(scene)}" if x == SHIPPED else x for x in policy or []]
        policies = named_paths("--policy", given)
        prepare_folder(out)
        results = {
            each.name: evaluation.measure(each, conditions)
            for each in evaluation.controllers(scene, policies)
        }
        evaluation.write(results, conditions, out)
    except (ValueError, OSError) as error:
        fail(error)
    echo(evaluation.table(results))
