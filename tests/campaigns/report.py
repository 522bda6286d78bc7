"""Reports of a campaign: text, JSON, table of ends, histogram, costliest scenes."""

from dataclasses import asdict
from pathlib import Path
from typing import Any

import numpy as np
from matplotlib.figure import Figure

from skate_env.common import files

from .campaign import MOST_RATIO, Result
from .episode import Accuracy, Episode, start

# Number of scenes that are written.
_SCENES = 10
_QUANTILES = {"median": 0.5, "p99": 0.99, "p99.99": 0.9999}


def summary(result: Result) -> dict[str, Any]:
    """Return the results of a campaign as JSON values; times in s."""
    worst = result.costliest(1)
    return {
        "seed": result.seed,
        "accuracy": result.accuracy,
        "steps": result.steps,
        "episodes": result.episodes,
        "simulated_time": result.simulated_time,
        "refused_starts": result.refused,
        "ends": dict(sorted(result.ends.items())),
        "failures": [asdict(failure) for failure in result.failures],
        "evaluations_per_step": {name: result.quantile(q) for name, q in _QUANTILES.items()},
        "costliest_step": asdict(worst[0]) if worst else None,
        "ratio": result.ratio,
        "most_ratio": MOST_RATIO,
        "passed": result.passed,
        "wall_time": result.wall_time,
    }


def text(result: Result) -> str:
    """Format the results of a campaign for a terminal."""
    rate = result.steps / max(result.wall_time, 1e-9)
    rows = [
        ("steps", f"{result.steps:,} in {result.episodes:,} episodes, {rate:,.0f} per second"),
        ("simulated", f"{result.simulated_time:,.1f} s"),
        ("refused starts", f"{result.refused:,}"),
        ("ends", ", ".join(f"{end} {count:,}" for end, count in result.ends.most_common())),
    ]
    if worst := result.costliest(1):
        sizes = ", ".join(f"{name} {result.quantile(q):,}" for name, q in _QUANTILES.items())
        cost = worst[0]
        rows += [
            ("evaluations per step", sizes),
            (
                "costliest step",
                f"{cost.evaluations:,} evaluations, {result.ratio:,.1f} times the median (at most "
                f"{MOST_RATIO:g}): episode {cost.episode}, step {cost.step}",
            ),
        ]
    lines = [f"{name:<20}{value}" for name, value in rows]
    for failure in result.failures:
        lines.append(
            f"FAILED: {failure.kind}, episode {failure.episode}, step {failure.step}: "
            f"{failure.message}"
        )
    if result.ratio > MOST_RATIO:
        lines.append("FAILED: the costliest step exceeds the limit")
    return "\n".join(lines)


def episode_text(episode: Episode) -> str:
    """Format the results of one episode."""
    evaluations = episode.evaluations
    said = f"episode {episode.number}: {len(evaluations)} steps, {episode.end}"
    if evaluations:
        most = max(evaluations)
        said += f", at most {most:,} evaluations per step (step {evaluations.index(most)})"
    failures = (f"FAILED: {f.kind}, step {f.step}: {f.message}" for f in episode.failures)
    return "\n".join([said, *failures])


def episode_summary(episode: Episode) -> dict[str, Any]:
    """Return the results of one episode as JSON values."""
    return asdict(episode)


def write_episode(seed: int, number: int, accuracy: Accuracy, out: Path | None) -> None:
    """Write an episode's scene into a folder, or print it."""
    scene, *_ = start(seed, number, accuracy)
    if out is None:
        print(scene.to_toml())
    else:
        files.write_text(out / f"episode_{number}.toml", scene.to_toml())


def write(result: Result, out: Path) -> None:
    """Write ends.csv, evaluations.png and the scenes of the costliest steps into a folder."""
    counted = result.ends.most_common()
    rows = [(end, count, f"{count / result.episodes:.6f}") for end, count in counted]
    files.write_csv(out / "ends.csv", [("end", "episodes", "share"), *rows])
    files.write_figure(out / "evaluations.png", histogram(result), 150)
    for rank, cost in enumerate(result.costliest(_SCENES), 1):
        scene, *_ = start(result.seed, cost.episode, result.accuracy)
        said = f"# seed {result.seed}, episode {cost.episode}: {cost.evaluations} evaluations in "
        path = out / f"costliest_{rank:02}_episode_{cost.episode}.toml"
        files.write_text(path, f"{said}step {cost.step}\n{scene.to_toml()}")


def histogram(result: Result) -> Figure:
    """Draw a histogram of the evaluations per step."""
    figure = Figure(figsize=(7.0, 4.2), layout="constrained")
    ax = figure.subplots()
    largest = max(result.counts.size - 1, 1)
    edges = np.unique(np.geomspace(1, largest + 1, 80).round())
    counts, edges = np.histogram(np.arange(result.counts.size), edges, weights=result.counts)
    ax.stairs(counts, edges, fill=True, color="#0072B2")
    median = result.quantile(0.5)
    ax.axvline(median, color="black", label=f"median, {median:,}")
    limit = MOST_RATIO * median
    ax.axvline(limit, color="#D55E00", ls="--", label=f"{MOST_RATIO:g} medians, {limit:,.0f}")
    ax.set(xscale="log", yscale="log", xlabel="evaluations of the dynamics per step of 10 ms")
    ax.set_ylabel("steps")
    ax.set_title(f"{result.steps:,} random steps, accuracy {result.accuracy}")
    ax.legend()
    return figure
