"""The page and the picture of the benchmark's results."""

import json
from collections.abc import Sequence
from pathlib import Path
from typing import Any

import matplotlib.pyplot as plt
import numpy as np
from matplotlib.figure import Figure

from skate_env.common import read_text, share_text
from skate_env.registration import IDS

from .controllers import UNTRAINED

# Limit on a file of results [bytes].
_LARGEST = 2**24
PAGE = """\
# Benchmark of learners

By `python -m training.benchmark report`. Trainings on the environments' own reward, in one
thread; `learners.py` has their settings. Evaluation: 30 s from 256 starts that training has not
seen, accuracy `balanced`, without the policy's noise. The goal is 100 steps in 60 s
(`IceSkate-v0`) or 20 steps in 10 s (the others). Times are processor time without evaluations, on
a machine with other work beside it. Numbers are means; returns of several seeds have their range,
shares of one seed their interval of 95 % (Wilson 1927). *Better* counts the seeds with a higher
return and a longer distance than zero actions.

"""


Results = dict[tuple[str, str], list[dict[str, Any]]]


def results(folder: Path) -> Results:
    """Read all results by environment and learner, ordered by seed."""
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
    """Format one row of the table."""
    finals = [run["final"] for run in runs]
    mean = {key: float(np.mean([each[key] for each in finals])) for key in finals[0]}
    score = f"{mean['return']:.1f}"
    if len(runs) > 1:
        returns = [each["return"] for each in finals]
        score += f" ({min(returns):.1f} to {max(returns):.1f})"
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


# Variants of the example, each kind in a table of its own below the others, with what begins it.
VARIANTS = {
    "without_": """
## Without a term of the reward

The example, trained without a term or limit of the reward, and evaluated with all of them.

""",
    "example_": """
## Accuracy of the training

The example, trained with time steps of 5 ms (`fast`) or under the default accuracy instead of time
steps of 1 ms.

""",
}


def page(found: Results) -> str:
    """Format the page of all results."""
    tables: dict[str, list[str]] = {kind: [] for kind in ("", *VARIANTS)}
    for (env_id, name), runs in found.items():
        kind = next((kind for kind in VARIANTS if name.startswith(kind)), "")
        tables[kind].append(row(runs, found[env_id, "zero"][0]["final"]))
    texts = [PAGE, *VARIANTS.values()]
    parts = zip(texts, tables.values(), strict=True)
    return "".join("\n".join([text + HEAD, *rows]) + "\n" for text, rows in parts if rows)


SHORT = {
    "zero": "zero actions",
    "random": "random actions",
    "ppo": "PPO, defaults of Stable-Baselines3",
    "example": "PPO, `ppo.py`",
    "shipped": "shipped policy",
}


def short_table(found: Results) -> str:
    """Format the README's table: means, and the share of the starts with the goal."""
    ids = list(dict.fromkeys(env_id for env_id, _ in found))
    head = "return, steps, distance, goal"
    lines = [
        f"| {head} | {' | '.join(f'`{env_id}`' for env_id in ids)} |",
        "|---" * (len(ids) + 1) + "|",
    ]
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
    """Draw returns over time: means and ranges over the seeds."""
    names = list(dict.fromkeys(name for _, name in found if name not in UNTRAINED))
    ids = list(dict.fromkeys(env_id for env_id, name in found if name in names))
    figure, axes = plt.subplots(
        1, len(ids), figsize=(4.2 * len(ids), 3.8), layout="constrained", squeeze=False
    )
    for ax, env_id in zip(axes[0], ids, strict=True):
        for index, name in enumerate(names):
            if name.startswith(tuple(VARIANTS)):
                continue
            runs = found.get((env_id, name))
            if runs is None:
                continue
            points = min(len(run["return"]) for run in runs)
            returns = np.array([run["return"][:points] for run in runs])
            minutes = np.median([run["minutes"][:points] for run in runs], axis=0)
            color = f"C{index}"
            label = f"{name}, {len(runs)} seed{'s' * (len(runs) > 1)}"
            ax.plot(minutes, returns.mean(0), color=color, label=label)
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
