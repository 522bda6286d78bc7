"""Benchmark of learners: one JSON file per training, one table and picture.

``python -m training.benchmark train --id IceSkate-v0 --learner ppo --seed 1`` repeats a training
with the settings of `learners`, ``all`` makes those that are missing, ``report`` draws all of
``training/benchmark/results``. Needs the extra ``train``.
"""

import json
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
from skate_env.common import (
    prepare_file,
    prepare_folder,
    read_text,
    share_text,
    write_figure,
    write_text,
)
from skate_env.policies import Policy, shipped
from skate_env.registration import IDS

from .held_out import Act, evaluate

HERE = Path(__file__).parent
RESULTS = HERE / "results"
SEEDS = range(5)
# Starts of an evaluation during a training.
FEW = 32
# Controllers that are not trained here, and the policy of each id.
UNTRAINED = ("zero", "random", "shipped")
POLICIES = dict(zip(IDS, ("paper", "push_only", "any_ice"), strict=True))
RESAMPLES = 10_000
# Limit on a file of results [bytes].
_LARGEST = 2**24
Array = NDArray[np.float64]
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
    keywords = {} if settings.accuracy is None else {"accuracy": settings.accuracy}
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
    curve.add(model.num_timesteps, act, 256)


def untrained(env_id: str, name: str) -> tuple[Act, dict[str, Any]]:
    """Return zero or random actions or the shipped policy, and keywords of its environment."""
    if name == "shipped":
        policy = Policy.load(shipped(POLICIES[env_id]))
        keywords = {key: x for key, x in policy.environment().items() if key != "scene"}
        return lambda seen: policy.predict(seen)[0], keywords
    space, rng = gymnasium.make(env_id).action_space, np.random.default_rng(0)
    assert space.shape is not None
    (joints,), scale = space.shape, {"zero": 0.0, "random": 1.0}[name]
    return lambda seen: scale * rng.uniform(-1.0, 1.0, (len(seen), joints)), {}


def play(env_id: str, learner: str, seed: int, actions: int, evaluations: int, out: Path) -> None:
    """Make one result."""
    file = out / env_id / learner / f"{seed}.json"
    prepare_file(file)
    curve = Curve(env_id, learner, seed, file)
    if learner in UNTRAINED:
        act, keywords = untrained(env_id, learner)
        curve.add(0, act, 256, **keywords)
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
    evaluations: Evaluations = 10,
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
def every(evaluations: Evaluations = 10, out: Out = RESULTS) -> None:
    """Make every result that is missing: all learners, five seeds, `IDS` without the last."""
    from .learners import LEARNERS

    for env_id in IDS:
        for name in UNTRAINED:
            if not (out / env_id / name / "0.json").exists():
                play(env_id, name, 0, 0, evaluations, out)
    for name in LEARNERS:
        for env_id in list(IDS)[:-1]:
            for seed in SEEDS:
                if not (out / env_id / name / f"{seed}.json").exists():
                    print(f"{env_id} {name} seed {seed}", flush=True)
                    play(env_id, name, seed, 0, evaluations, out)


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


Results = dict[tuple[str, str], list[dict[str, Any]]]


def results(folder: Path) -> Results:
    """All results by environment and learner, ordered by seed."""
    found: Results = {}
    for file in sorted(folder.glob("*/*/*.json"), key=lambda file: int(file.stem)):
        run = json.loads(read_text(file, _LARGEST))
        found.setdefault((run["id"], run["learner"]), []).append(run)
    first = ["zero", "random", "shipped", "example", "ppo"]
    order = [*first, *(name for _, name in found if name not in first)]
    ids = [*IDS, *(env_id for env_id, _ in found)]
    return dict(
        sorted(found.items(), key=lambda item: (ids.index(item[0][0]), order.index(item[0][1])))
    )


HEAD = """\
| id | controller | seeds | actions | minutes | return | distance [m] | steps | slide per step [m] \
| in the air | share of starts with the goal, by seed | better than zero actions |
|---|---|---|---|---|---|---|---|---|---|---|---|"""


def row(runs: Sequence[dict[str, Any]], zero: dict[str, Any]) -> str:
    """One row of the table."""
    finals = [run["final"] for run in runs]
    mean = {key: float(np.mean([each[key] for each in finals])) for key in finals[0]}
    score = f"{mean['return']:.1f}"
    if len(runs) > 1:
        returns = np.array([each["return"] for each in finals])
        score = "{:.1f} ({:.1f} to {:.1f})".format(*interval(returns))
    shares = ", ".join(f"{100.0 * each['goal'] / each['starts']:.0f}" for each in finals) + " %"
    if len(runs) == 1:
        shares = share_text(int(finals[0]["goal"]), int(finals[0]["starts"]))
    better = sum(all(each[key] > zero[key] for key in ("return", "distance")) for each in finals)
    trained = runs[0]["learner"] not in UNTRAINED
    cells = [
        f"`{runs[0]['id']}`",
        runs[0]["learner"],
        f"{len(runs)}" if trained else "",
        f"{runs[0]['actions'][-1]:,}" if trained else "",
        f"{np.median([run['minutes'][-1] for run in runs]):.1f}" if trained else "",
        score,
        f"{mean['distance']:.1f}",
        f"{mean['steps']:.1f}",
        f"{mean['slide']:.2f}",
        f"{100.0 * mean['flight']:.1f} %",
        shares,
        f"{better} of {len(runs)}" if trained else "",
    ]
    return "| " + " | ".join(cells) + " |"


def table(found: Results) -> str:
    """Format the table of all results."""
    rows = [row(runs, found[env_id, "zero"][0]["final"]) for (env_id, _), runs in found.items()]
    return "\n".join([HEAD, *rows])


SHORT = {
    "zero": "zero actions",
    "random": "random actions",
    "ppo": "PPO, defaults of Stable-Baselines3",
    "example": "PPO, `ppo.py`",
    "shipped": "shipped policy",
}


def short_table(found: Results) -> str:
    """Format the README's table: mean return, steps and distance, and the share with the goal."""
    ids = list(dict.fromkeys(env_id for env_id, _ in found))
    lines = [f"| | {' | '.join(f'`{env_id}`' for env_id in ids)} |", "|---" * (len(ids) + 1) + "|"]
    for name, shown in SHORT.items():
        cells = [_short_cell(found.get((env_id, name), [])) for env_id in ids]
        if any(cells):
            lines.append(f"| {shown} | {' | '.join(cells)} |")
    return "\n".join(lines)


def _short_cell(runs: Sequence[dict[str, Any]]) -> str:
    if not runs:
        return ""
    finals = [run["final"] for run in runs]
    score, steps, way = (
        float(np.mean([each[key] for each in finals])) for key in ("return", "steps", "distance")
    )
    made, starts = (int(sum(each[key] for each in finals)) for key in ("goal", "starts"))
    return f"{score:.1f}, {steps:.0f}, {way:.0f} m, {share_text(made, starts)}"


def draw(found: Results) -> Figure:
    """Draw returns over time: interquartile means, and ranges of all seeds."""
    names = list(dict.fromkeys(name for _, name in found if name not in UNTRAINED))
    ids = list(dict.fromkeys(env_id for env_id, name in found if name in names))
    figure, axes = plt.subplots(
        1, len(ids), figsize=(4.2 * len(ids), 3.8), layout="constrained", squeeze=False
    )
    for ax, env_id in zip(axes[0], ids, strict=True):
        for index, name in enumerate(names):
            runs = found.get((env_id, name))
            if runs is None:
                continue
            points = min(len(run["return"]) for run in runs)
            returns = np.array([run["return"][:points] for run in runs])
            minutes = np.median([run["minutes"][:points] for run in runs], axis=0)
            color = f"C{index}"
            label = f"{name}, {len(runs)} seeds"
            ax.plot(minutes, interquartile_mean(returns.T), color=color, label=label)
            ax.fill_between(minutes, returns.min(0), returns.max(0), color=color, alpha=0.2, lw=0)
        for name, style in (("zero", ":"), ("shipped", "--")):
            for run in found.get((env_id, name), []):
                ax.axhline(run["final"]["return"], color="0.3", ls=style, lw=1, label=name)
        ax.set_title(env_id, fontsize=10)
        ax.set_xlabel("processor time [min]")
        ax.legend(fontsize=7)
        ax.grid(alpha=0.3)
    axes[0, 0].set_ylabel("return in 30 s")
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
    text = table(found)
    write_text(out / "benchmark.md", text + "\n")
    write_text(out / "readme.md", short_table(found) + "\n")
    write_figure(out / "benchmark.png", draw(found), dpi=110)
    print(text)


if __name__ == "__main__":
    app()
