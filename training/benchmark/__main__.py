"""Benchmark of learners: one JSON file per training, one table and picture.

``python -m training.benchmark train --id IceSkate-v0 --learner ppo --seed 1`` repeats a training
with the settings of `learners`, ``all`` makes those that are missing, ``report`` draws all of
``training/benchmark/results``. Needs the extra ``train``.
"""

import json
import time
from pathlib import Path
from typing import Annotated, Any

import numpy as np
import typer
from numpy.typing import NDArray

from skate_env.cli.options import path
from skate_env.common import prepare_file, prepare_folder, write_figure, write_text
from skate_env.registration import IDS

from . import accuracies
from .controllers import UNTRAINED, untrained
from .held_out import STARTS, Act, evaluate
from .tables import draw, page, results, short_table

HERE = Path(__file__).parent
RESULTS = HERE / "results"
SEEDS = range(5)
# Starts of an evaluation during a training.
FEW = 32
app = typer.Typer(help=__doc__, no_args_is_help=True)


class Curve:
    """Evaluations of a training, with its actions and minutes of processor time."""

    def __init__(self, env_id: str, learner: str, seed: int, file: Path) -> None:
        self.file, self.env_id = file, env_id
        self.contents: dict[str, Any] = {"id": env_id, "learner": learner, "seed": seed}
        self.spent, self.since = 0.0, time.process_time()

    def add(self, actions: int, act: Act, starts: int = FEW, **keywords: Any) -> None:
        """Evaluate. The time of evaluations does not count."""
        self.spent += time.process_time() - self.since
        seen = evaluate(self.env_id, act, starts, **keywords)
        point = {"actions": actions, "minutes": round(self.spent / 60.0, 2)}
        for key, value in (point | {"return": round(seen["return"], 3)}).items():
            self.contents.setdefault(key, []).append(value)
        self.contents["final"] = {key: round(value, 4) for key, value in seen.items()}
        print(point | self.contents["final"], flush=True)
        self.since = time.process_time()

    def write(self) -> None:
        """Write the file."""
        write_text(self.file, json.dumps(self.contents) + "\n")


def fit(curve: Curve, learner: str, seed: int, total: int, evaluations: int) -> None:
    """Train with a learner's settings; 0 stands for its number of actions."""
    import sb3_contrib
    import stable_baselines3
    import torch
    from stable_baselines3.common.callbacks import BaseCallback
    from stable_baselines3.common.env_util import make_vec_env
    from stable_baselines3.common.vec_env import VecNormalize

    from .learners import LEARNERS

    torch.set_num_threads(1)
    settings = LEARNERS[learner]
    total = total or settings.actions
    keywords: dict[str, Any] = {"reward": settings.reward}
    if settings.accuracy is not None:
        keywords["accuracy"] = settings.accuracy
    envs = make_vec_env(curve.env_id, settings.environments, seed, env_kwargs=keywords)
    normalise: Any = None
    if settings.normalise:
        envs = normalise = VecNormalize(envs, gamma=settings.settings.get("gamma", 0.99))
    kind = getattr(stable_baselines3, settings.algorithm, None)
    kind = kind or getattr(sb3_contrib, settings.algorithm)
    model: Any = kind("MlpPolicy", envs, seed=seed, device="cpu", **settings.settings)

    def act(observations: NDArray[np.float32]) -> NDArray[np.float32]:
        if normalise is not None:
            observations = normalise.normalize_obs(observations)
        actions: NDArray[np.float32] = model.predict(observations, deterministic=True)[0]
        return actions

    class Report(BaseCallback):
        last = 0

        def _on_step(self) -> bool:
            return True

        def _on_rollout_start(self) -> None:
            # After an update of the networks.
            if self.num_timesteps - self.last >= total / evaluations:
                self.last = self.num_timesteps
                curve.add(self.num_timesteps, act)

    model.learn(total, callback=Report())
    curve.add(model.num_timesteps, act, STARTS)
    if (curve.env_id, learner) in accuracies.RUNS:
        curve.contents["reference"] = evaluate(curve.env_id, act, accuracy="reference")


def play(env_id: str, learner: str, seed: int, actions: int, evaluations: int, out: Path) -> None:
    """Make one result."""
    file = out / env_id / learner / f"{seed}.json"
    prepare_file(file)
    curve = Curve(env_id, learner, seed, file)
    if learner in UNTRAINED:
        act, keywords = untrained(env_id, learner)
        curve.add(0, act, STARTS, **keywords)
    else:
        fit(curve, learner, seed, actions, evaluations)
    curve.write()


Learner = Annotated[str, typer.Option("--learner", help="One of `learners`, or an untrained one.")]
Out = Annotated[Path, typer.Option(parser=path, help="Folder of the results.")]
Evaluations = Annotated[int, typer.Option(min=1, help="In equal distances.")]


@app.command()
def train(
    env_id: Annotated[str, typer.Option("--id")] = "IceSkate-v0",
    learner: Learner = "ppo",
    seed: int = 0,
    actions: Annotated[int, typer.Option(help="0: those of the learner.")] = 0,
    evaluations: Evaluations = 4,
    out: Out = RESULTS,
) -> None:
    """Train once and write ``OUT/ID/LEARNER/SEED.json``."""
    from .learners import LEARNERS

    known = (*LEARNERS, *UNTRAINED)
    if learner not in known:
        raise typer.BadParameter(f"--learner: must be one of {', '.join(known)}, not {learner}")
    if env_id not in IDS:
        raise typer.BadParameter(f"--id: must be one of {', '.join(IDS)}, not {env_id}")
    play(env_id, learner, seed, actions, evaluations, out)


@app.command("all")
def every(evaluations: Evaluations = 4, out: Out = RESULTS) -> None:
    """Make every result that is missing: all learners, five seeds, `IDS` without the last."""
    from .learners import LEARNERS

    for env_id in IDS:
        for name in UNTRAINED:
            if not (out / env_id / name / "0.json").exists():
                play(env_id, name, 0, 0, evaluations, out)
    for name in LEARNERS:
        for env_id in list(IDS)[:-1]:
            # The example's other accuracies are compared on one id.
            if name in accuracies.NAMES and name != "example" and env_id != accuracies.ID:
                continue
            for seed in SEEDS:
                if not (out / env_id / name / f"{seed}.json").exists():
                    print(f"{env_id} {name} seed {seed}", flush=True)
                    play(env_id, name, seed, 0, evaluations, out)


@app.command()
def report(
    folder: Annotated[
        Path, typer.Option("--results", parser=path, help="Folder of the results.")
    ] = RESULTS,
    out: Annotated[Path, typer.Option(parser=path, help="Folder of table and picture.")] = Path(
        "out/benchmark"
    ),
) -> None:
    """Write the page and the picture of all results, and the README's table."""
    found = results(folder)
    if not found:
        raise typer.BadParameter(f"--results: {folder} has no results")
    prepare_folder(out)
    text = page(found)
    write_text(out / "benchmark.md", text)
    write_text(out / "readme.md", short_table(found) + "\n")
    write_figure(out / "benchmark.png", draw(found), dpi=110)
    if all("reference" in run for name in accuracies.RUNS for run in found.get(name, [{}])):
        write_figure(out / "training-accuracy.png", accuracies.draw(found), dpi=110)
    print(text)


if __name__ == "__main__":
    app()
