"""Comparison of controllers over perturbed starts.

All controllers have the same starts and the same kicks, none of which occur in training. Policies
of several training seeds count as one controller.
"""

import json
from collections.abc import Mapping, Sequence
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from .._core import Scene
from ..common import files, progress_bar, share_text
from ..policies import Policy, baseline, load
from .rollouts import UNITS, Conditions, Controller, run
from .statistics import interquartile_mean

Array = NDArray[np.float64]

# Statistics that tables show as shares of all episodes.
SHARES = ("completed", "fell")


@dataclass(frozen=True)
class Contender:
    """A controller, or several that differ in their training seed.

    Attributes
    ----------
    name
        Name in tables.
    controllers
        Controllers with the keywords of their environments.
    deterministic
        Whether they act without noise.
    """

    name: str
    controllers: Sequence[tuple[Controller, dict[str, Any]]]
    deterministic: bool = True


def controllers(
    scene: Scene | str | Path, policies: Mapping[str, Sequence[Path]]
) -> list[Contender]:
    """Return the baseline, its lifting alone, and each policy; learned ones with noise, too.

    Raises
    ------
    ValueError
        If a scene or file does not exist, a file is not a policy, or two names are equal.
    """
    plain = {"baseline": baseline.no_residual(scene), "lifting only": baseline.lifting_only(scene)}
    every = [Contender(name, [(each, {"scene": each.scene})]) for name, each in plain.items()]
    for name, paths in policies.items():
        loaded = [load(path) for path in paths]
        trained = [(policy, policy.environment(randomise=True)) for policy in loaded]
        every.append(Contender(name, trained))
        if all(isinstance(policy, Policy) for policy in loaded):
            every.append(Contender(f"{name}, with noise", trained, deterministic=False))
    names = [each.name for each in every]
    for name in names:
        if names.count(name) > 1:
            raise ValueError(f"policy {name!r}: another controller has this name")
    return every


def measure(contender: Contender, conditions: Conditions) -> dict[str, Array]:
    """Run the policies of one controller; return statistics (training seeds, episodes) by name."""
    total = len(contender.controllers) * conditions.episodes
    with progress_bar(total, contender.name, "episode") as bar:
        how: dict[str, Any] = {"deterministic": contender.deterministic, "progress": bar.update}
        runs = [run(*each, conditions, **how) for each in contender.controllers]
    return {name: np.stack([one[name] for one in runs]) for name in UNITS}


def table(results: dict[str, dict[str, Array]]) -> str:
    """Format a Markdown table: a row for each statistic, a column for each controller."""
    lines = [f"| | {' | '.join(results)} |", "|---" * (len(results) + 1) + "|"]
    for name, unit in UNITS.items():
        cells = [_cell(name, measured[name]) for measured in results.values()]
        label = name.replace("_", " ") + (f" [{unit}]" if unit != "1" else "")
        lines.append(f"| {label} | " + " | ".join(cells) + " |")
    return "\n".join(lines)


def _cell(name: str, values: Array) -> str:
    if name in SHARES:
        return share_text(int(values.sum()), values.size)
    estimate = interquartile_mean(values)
    if np.isnan(estimate.mean):
        return "-"
    return f"{estimate.mean:.3g} ({estimate.low:.3g} to {estimate.high:.3g})"


def write(results: dict[str, dict[str, Array]], conditions: Conditions, folder: Path) -> None:
    """Write ``evaluation.md`` (table) and ``evaluation.json`` (all episodes) into a folder."""
    files.write_text(folder / "evaluation.md", table(results) + "\n")
    episodes = {
        name: {figure: values.tolist() for figure, values in measured.items()}
        for name, measured in results.items()
    }
    data = {"conditions": asdict(conditions), "episodes": episodes}
    files.write_text(folder / "evaluation.json", json.dumps(data))
