"""The command ``skate-env train``: PPO of Stable-Baselines3."""

from pathlib import Path
from typing import Annotated

import typer

from ..learning import LAST_TRAINING_SEED
from .options import (
    MOST_JOBS,
    SceneOption,
    WithoutOption,
    echo,
    fail,
    name_and_value,
    path,
    requires,
)

# Options that a resumed training takes from its checkpoint.
_FIXED = {
    name: f"--{name.strip('_')}"
    for name in ("scene", "seed", "set_", "without", "threads", "from_")
}


def train(
    ctx: typer.Context,
    out: Annotated[
        Path, typer.Option(parser=path, help="Folder of policy, checkpoint and learning curves.")
    ],
    scene: SceneOption = "push_only",
    seed: Annotated[
        int, typer.Option(min=0, max=LAST_TRAINING_SEED, help="Seed of all random numbers.")
    ] = 1,
    set_: Annotated[
        list[str] | None,
        typer.Option(
            "--set", metavar="NAME=VALUE", help="Override a hyperparameter; may be repeated."
        ),
    ] = None,
    from_: Annotated[
        Path | None,
        typer.Option(
            "--from", parser=path, metavar="POLICY", help="Begin with the network of this policy."
        ),
    ] = None,
    resume: Annotated[
        bool, typer.Option("--resume", help="Continue from the checkpoint in the folder.")
    ] = False,
    without: WithoutOption = None,
    threads: Annotated[
        int,
        typer.Option(min=1, max=MOST_JOBS, help="Threads of the environments; PyTorch uses one."),
    ] = 1,
) -> None:
    """Train a residual policy with PPO.

    The policy adds torques to those of the scene's controller. Needs Stable-Baselines3 and
    PyTorch: pip install "skate-env[train]". The folder receives policy.npz (read it with
    skate_env.Policy.load), checkpoint.pkl and TensorBoard events.

    \b
    With push-only contact:
      skate-env train --scene push_only --seed 1 --out out/push_only/1
    Learning curves, with every term of the reward:
      tensorboard --logdir out
    Resume a training; the resulting policy is the same as without the interruption:
      skate-env train --out out/push_only/1 --resume
    Learn from scratch, without the controller's torques:
      skate-env train --without feedforward --without lifting --out out/scratch/1
    Go on with a policy, with less noise; the critic learns alone at first:
      skate-env train --from out/push_only/1/policy.npz --set noise=0.12 --set critic_updates=30
      --out out/push_only/2
    Override hyperparameters (skate_env/learning/configs.py lists them):
      skate-env train --set actions=300000 --set layers=[128,128] --out out/try
    """  # noqa: D301 (\b keeps the examples' line breaks)
    with requires("train"):
        from ..learning import ppo
        from ..learning.export import digest
    try:
        if resume:
            sources = {flag: ctx.get_parameter_source(name) for name, flag in _FIXED.items()}
            given = [flag for flag, of in sources.items() if of and of.name == "COMMANDLINE"]
            if given:
                raise ValueError(f"{', '.join(given)}: --resume uses the checkpoint's own")
            policy = ppo.resume(out)
        else:
            overrides = [name_and_value(text, "rate=1e-3") for text in set_ or []]
            policy = ppo.train(out, scene, seed, overrides, without or [], threads, from_)
    except (ValueError, OSError) as error:
        fail(error)
    echo(f"{'policy':<12}{out / ppo.POLICY}")
    echo(f"{'SHA-256':<12}{digest(policy)}")
