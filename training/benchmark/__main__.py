"""Benchmark of learners: five seeds each, one JSON file per training, one table and picture.

``python -m training.benchmark train --id IceSkatePushOnly-v0 --method ppo --seed 1`` reproduces a
training; ``python -m training.benchmark report`` draws all of ``training/benchmark/results``. RL
Baselines3 Zoo trains PPO and SAC with the files of ``hyperparameters``, ``shac`` SHAC. ``train``
needs the extra ``train``.
"""

import argparse
import contextlib
import io
import json
import tempfile
import time
from collections.abc import Sequence
from pathlib import Path
from typing import Annotated, Any

import gymnasium
import matplotlib.pyplot as plt
import numpy as np
import typer
from matplotlib.figure import Figure
from numpy.typing import NDArray

from skate_env.cli.options import path
from skate_env.common import prepare_file, prepare_folder, read_text, write_figure, write_text

from .held_out import Act, action_period, evaluate

HERE = Path(__file__).parent
RESULTS = HERE / "results"
METHODS = ("ppo", "sac", "shac")
RESAMPLES = 10_000
# Limit on a file of results [bytes].
_LARGEST = 2**24
Array = NDArray[np.float64]
app = typer.Typer(help=__doc__, no_args_is_help=True)


class Curve:
    """Evaluations of a training, with its actions and minutes of processor time."""

    def __init__(self, env_id: str, method: str, seed: int, file: Path) -> None:
        self.file, self.env_id = file, env_id
        self.contents: dict[str, Any] = {"id": env_id, "method": method, "seed": seed}
        self.contents["action_period"] = action_period(env_id)
        self.spent, self.since = 0.0, time.process_time()

    def add(self, actions: int, act: Act) -> None:
        """Evaluate, and write the file. The time of evaluations does not count."""
        self.spent += time.process_time() - self.since
        point = {"actions": actions, "minutes": round(self.spent / 60.0, 3)}
        point |= {key: round(value, 4) for key, value in evaluate(self.env_id, act).items()}
        for key, value in point.items():
            self.contents.setdefault(key, []).append(value)
        write_text(self.file, json.dumps(self.contents) + "\n")
        print(point, flush=True)
        self.since = time.process_time()


def zoo(curve: Curve, method: str, seed: int, total: int, evaluations: int) -> None:
    """Train with RL Baselines3 Zoo; 0 stands for the actions of the hyperparameters' file."""
    from rl_zoo3.exp_manager import ExperimentManager
    from stable_baselines3.common.callbacks import BaseCallback
    from stable_baselines3.common.vec_env import VecNormalize

    class Report(BaseCallback):
        last = 0

        def _on_step(self) -> bool:
            return True

        def _on_rollout_start(self) -> None:
            # After an update of the networks.
            if self.num_timesteps - self.last >= every:
                self.last = self.num_timesteps
                curve.add(self.num_timesteps, act)

    def act(observations: NDArray[np.float32]) -> NDArray[np.float32]:
        normalise = model.get_vec_normalize_env()
        assert isinstance(normalise, VecNormalize)
        actions, _ = model.predict(normalise.normalize_obs(observations), deterministic=True)
        return actions

    with tempfile.TemporaryDirectory() as folder:
        # The zoo prints its settings.
        with contextlib.redirect_stdout(io.StringIO()):
            manager = ExperimentManager(
                argparse.Namespace(),
                method,
                curve.env_id,
                folder,
                n_timesteps=total,
                eval_freq=-1,
                seed=seed,
                device="cpu",
                verbose=0,
                log_interval=-2,  # none
                config=str(HERE / "hyperparameters" / f"{method}.yml"),
            )
            made = manager.setup_experiment()
        assert made is not None
        model, _ = made
        every = manager.n_timesteps // evaluations
        manager.callbacks.append(Report())
        manager.learn(model)
    curve.add(model.num_timesteps, act)


def shac(curve: Curve, seed: int, total: int, every: int) -> None:
    """Train with the derivatives of the engine."""
    from .shac import Hyperparameters, Shac

    agent, last = Shac(curve.env_id, seed, Hyperparameters(), total), 0
    while agent.actions < total:
        agent.update()
        if agent.actions - last >= every or agent.actions >= total:
            last = agent.actions
            curve.add(agent.actions, agent.act)


@app.command()
def train(
    env_id: Annotated[str, typer.Option("--id")] = "IceSkatePushOnly-v0",
    method: Annotated[str, typer.Option(help=", ".join(METHODS))] = "ppo",
    seed: int = 1,
    actions: Annotated[int, typer.Option(help="0: those of the hyperparameters' file.")] = 0,
    evaluations: Annotated[int, typer.Option(min=1, help="In equal distances.")] = 15,
    out: Annotated[Path, typer.Option(parser=path, help="Folder of the result.")] = RESULTS,
) -> None:
    """Train once and write ``OUT/ID/METHOD/SEED.json``."""
    import torch

    torch.set_num_threads(1)
    if method not in METHODS:
        raise typer.BadParameter(f"--method: must be one of {', '.join(METHODS)}, not {method}")
    if env_id not in gymnasium.registry:
        raise typer.BadParameter(f"--id: {env_id} is not a registered environment")
    file = out / env_id / method / f"{seed}.json"
    prepare_file(file)
    curve = Curve(env_id, method, seed, file)
    if method == "shac":
        total = actions or 120_000
        shac(curve, seed, total, total // evaluations)
        return
    zoo(curve, method, seed, actions, evaluations)


def interquartile_mean(values: Array) -> Array:
    """Mean of the middle half along the last axis; values at its edges count in part."""
    values = np.sort(values, axis=-1)
    n = values.shape[-1]
    edges = np.arange(n + 1).clip(n / 4, 3 * n / 4)
    weights = np.diff(edges) / (n / 2)
    mean: Array = values @ weights
    return mean


def interval(values: Array) -> tuple[float, float, float]:
    """Interquartile mean over seeds (n,), and its 95 % interval by the bootstrap percentiles."""
    rng = np.random.default_rng(0)
    drawn = interquartile_mean(rng.choice(values, (RESAMPLES, len(values))))
    low, high = np.percentile(drawn, [2.5, 97.5])
    return float(interquartile_mean(values)), float(low), float(high)


def results(folder: Path) -> dict[tuple[str, str], list[dict[str, Any]]]:
    """All trainings by environment and method, ordered by seed."""
    found: dict[tuple[str, str], list[dict[str, Any]]] = {}
    for file in sorted(folder.glob("*/*/*.json"), key=lambda file: int(file.stem)):
        run = json.loads(read_text(file, _LARGEST))
        found.setdefault((run["id"], run["method"]), []).append(run)
    return dict(sorted(found.items()))


def row(runs: Sequence[dict[str, Any]]) -> str:
    """One row of the table: last evaluations, and when half of the starts make 20 steps."""
    last = {key: np.array([run[key][-1] for run in runs]) for key in ("return", "steps", "share")}
    flight = np.array([run["flight"][-1] for run in runs])
    score = "{:.1f} ({:.1f} to {:.1f})".format(*interval(last["return"]))
    steps = ", ".join(f"{x:g}" for x in last["steps"])
    share = "{:.0%}".format(float(interquartile_mean(last["share"]))).replace("%", " %")
    cells = [
        f"{runs[0]['id']}, {1000.0 * runs[0]['action_period']:g} ms",
        runs[0]["method"],
        f"{len(runs)}",
        f"{runs[0]['actions'][-1]:,}",
        f"{np.median([run['minutes'][-1] for run in runs]):.1f}",
        score,
        steps,
        share,
        f"{float(interquartile_mean(flight)):.0%}".replace("%", " %"),
        reached(runs),
    ]
    return "| " + " | ".join(cells) + " |"


def reached(runs: Sequence[dict[str, Any]]) -> str:
    """Median over seeds of the actions and minutes after which half of the starts make 20 steps."""
    first = []
    for run in runs:
        at = next((i for i, share in enumerate(run["share"]) if share >= 0.5), None)
        if at is not None:
            first.append((run["actions"][at], run["minutes"][at]))
    if 2 * len(first) <= len(runs):
        return f"{len(first)} of {len(runs)} seeds"
    actions, minutes = np.median(first, axis=0)
    return f"{len(first)} of {len(runs)} seeds: {actions:,.0f}, {minutes:.1f} minutes"


HEAD = """\
| id | method | seeds | actions | minutes | return in 10 s, IQM (95 %) | steps by seed \
| 20 steps | in the air | half of the starts make 20 steps |
|---|---|---|---|---|---|---|---|---|---|"""


def draw(found: dict[tuple[str, str], list[dict[str, Any]]]) -> Figure:
    """Draw returns over time: interquartile means, and ranges of all seeds."""
    ids = sorted({env_id for env_id, _ in found})
    figure, axes = plt.subplots(
        1, len(ids), figsize=(4.2 * len(ids), 3.8), layout="constrained", squeeze=False
    )
    for ax, env_id in zip(axes[0], ids, strict=True):
        for index, method in enumerate(METHODS):
            runs = found.get((env_id, method))
            if runs is None:
                continue
            points = min(len(run["return"]) for run in runs)
            returns = np.array([run["return"][:points] for run in runs])
            minutes = np.median([run["minutes"][:points] for run in runs], axis=0)
            label = f"{method.upper()}, {len(runs)} seeds"
            color = f"C{index}"
            ax.plot(minutes, interquartile_mean(returns.T), color=color, label=label)
            ax.fill_between(minutes, returns.min(0), returns.max(0), color=color, alpha=0.2, lw=0)
        ax.set_title(env_id, fontsize=10)
        ax.set_xlabel("processor time [min]")
        ax.legend(fontsize=8)
        ax.grid(alpha=0.3)
    axes[0, 0].set_ylabel("return in 10 s")
    return figure


@app.command()
def report(
    folder: Annotated[
        Path, typer.Option("--results", parser=path, help="Folder of the results.")
    ] = RESULTS,
    out: Annotated[Path, typer.Option(parser=path, help="Folder of table and picture.")] = Path(
        "out/benchmark"
    ),
) -> None:
    """Write the table and the picture of all results."""
    found = results(folder)
    if not found:
        raise typer.BadParameter(f"--results: {folder} has no results")
    prepare_folder(out)
    table = "\n".join([HEAD, *(row(runs) for runs in found.values())])
    write_text(out / "benchmark.md", table + "\n")
    write_figure(out / "benchmark.png", draw(found), dpi=110)
    print(table)


if __name__ == "__main__":
    app()
