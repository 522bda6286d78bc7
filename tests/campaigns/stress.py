"""``python -m tests.campaigns.stress``: random scenes under random torques.

Episodes run in several processes; the results do not depend on the number of processes.
"""

import itertools
import json
import multiprocessing as mp
import os
import threading
import time
from collections import Counter, deque
from collections.abc import Callable
from concurrent.futures import Future, ProcessPoolExecutor, wait
from concurrent.futures.process import BrokenProcessPool
from dataclasses import asdict, dataclass, field
from pathlib import Path
from typing import Annotated, Any

import numpy as np
import typer
from matplotlib.figure import Figure
from numpy.typing import NDArray

from skate_env.cli.options import (
    MOST_JOBS,
    JsonOption,
    ScenesAccuracyOption,
    ScenesSeedOption,
    fail,
    path,
    value,
)
from skate_env.common import prepare_folder, progress_bar, write_figure, write_text

from .draw import Accuracy, draw_scene
from .episode import Episode, Failure, run, start

TIMEOUT = 60.0
"""Wall time after which an episode counts as hanging [s]."""
MOST_RATIO = 50.0
"""Largest ratio of the costliest step to the median that passes."""

# Queued episodes per process.
_QUEUE = 24
# Number of scenes that are written.
_SCENES = 10
_QUANTILES = {"median": 0.5, "p99": 0.99, "p99.99": 0.9999}


@dataclass(frozen=True)
class Cost:
    """The costliest step of an episode."""

    evaluations: int
    episode: int
    step: int


@dataclass
class Result:
    """Results of a campaign; all but `wall_time` is a function of seed, accuracy and steps."""

    seed: int
    accuracy: Accuracy
    steps: int = 0
    episodes: int = 0
    simulated_time: float = 0.0
    refused: int = 0
    ends: Counter[str] = field(default_factory=Counter)
    failures: list[Failure] = field(default_factory=list)
    costs: list[Cost] = field(default_factory=list)
    counts: NDArray[np.int64] = field(default_factory=lambda: np.zeros(0, np.int64))
    """Number of steps with 0, 1, 2, ... evaluations."""
    wall_time: float = 0.0

    def add(self, episode: Episode) -> None:
        """Add the results of an episode."""
        self.steps += len(episode.evaluations)
        self.episodes += 1
        self.simulated_time += episode.time
        self.refused += episode.refused
        self.ends[episode.end] += 1
        self.failures += episode.failures
        if episode.evaluations:
            most = max(episode.evaluations)
            self.costs.append(Cost(most, episode.number, episode.evaluations.index(most)))
            counts = np.bincount(episode.evaluations, minlength=self.counts.size)
            counts[: self.counts.size] += self.counts
            self.counts = counts

    def quantile(self, share: float) -> int:
        """Return a quantile of the evaluations per step."""
        return int(np.searchsorted(np.cumsum(self.counts), share * self.steps))

    def costliest(self, number: int) -> list[Cost]:
        """Return the costliest steps, at most one for each episode."""
        return sorted(self.costs, key=lambda cost: (-cost.evaluations, cost.episode))[:number]

    @property
    def ratio(self) -> float:
        """Evaluations of the costliest step, divided by the median."""
        return (self.counts.size - 1) / max(self.quantile(0.5), 1) if self.steps else 0.0

    @property
    def passed(self) -> bool:
        """Whether nothing failed and no step was too costly."""
        return not self.failures and self.ratio <= MOST_RATIO

    def summary(self) -> dict[str, Any]:
        """Return the results as JSON values; times in s."""
        found = asdict(self)
        for name in ("costs", "counts"):
            del found[name]
        worst = self.costliest(1)
        return found | {
            "ends": dict(sorted(self.ends.items())),
            "evaluations_per_step": {name: self.quantile(q) for name, q in _QUANTILES.items()},
            "costliest_step": asdict(worst[0]) if worst else None,
            "ratio": self.ratio,
            "passed": self.passed,
        }

    def text(self) -> str:
        """Format the results for a terminal."""
        rate = self.steps / max(self.wall_time, 1e-9)
        ends = ", ".join(f"{end} {count:,}" for end, count in self.ends.most_common())
        sizes = ", ".join(f"{name} {self.quantile(q):,}" for name, q in _QUANTILES.items())
        lines = [
            f"steps: {self.steps:,} in {self.episodes:,} episodes, {rate:,.0f} per second; "
            f"{self.simulated_time:,.1f} s simulated; {self.refused:,} refused starts",
            f"ends: {ends}",
            f"evaluations of the dynamics per step: {sizes}",
        ]
        for cost in self.costliest(1):
            lines.append(
                f"costliest step: {cost.evaluations:,} evaluations, {self.ratio:,.1f} times the "
                f"median (at most {MOST_RATIO:g}): episode {cost.episode}, step {cost.step}"
            )
        lines += [failure.text() for failure in self.failures]
        if self.ratio > MOST_RATIO:
            lines.append("FAILED: the costliest step exceeds the limit")
        return "\n".join(lines)


def make(
    seed: int,
    steps: int,
    accuracy: Accuracy,
    jobs: int,
    progress: Callable[[int], object] = lambda steps: None,
    timeout: float = TIMEOUT,
) -> Result:
    """Run episodes 0, 1, ... until they have `steps` steps in total, or until one hangs.

    ``progress`` is called with the number of steps of every episode.

    Raises
    ------
    ValueError
        If the accuracy is unknown.
    """
    draw_scene(np.random.default_rng(0), accuracy)
    result = Result(seed, accuracy)
    started, others = time.monotonic(), mp.active_children()
    # Fresh interpreters: a fork would copy the locks of the progress bar's thread.
    pool = ProcessPoolExecutor(jobs, mp.get_context("spawn"), initializer=_end_with_parent)
    tasks: deque[Future[Episode]] = deque()
    try:
        for number in itertools.count():
            tasks.append(pool.submit(run, seed, number, accuracy))
            if len(tasks) < _QUEUE * jobs:
                continue
            # All episodes before the first in the queue are complete, so that it is running.
            if not wait([tasks[0]], timeout=timeout).done:
                message = f"takes longer than {timeout} s"
                result.failures.append(Failure("hang", result.episodes, 0, message))
                break
            episode = tasks.popleft().result()
            result.add(episode)
            progress(len(episode.evaluations))
            if result.steps >= steps:
                break
    except BrokenProcessPool as broken:
        message = f"in this episode or one of the next {_QUEUE * jobs}: {broken}"
        result.failures.append(Failure("process died", result.episodes, 0, message))
    finally:
        # Without waiting for episodes, which may hang.
        pool.shutdown(wait=False, cancel_futures=True)
        for child in mp.active_children():
            if child not in others:
                child.kill()
    result.wall_time = time.monotonic() - started
    return result


def _end_with_parent() -> None:
    """Let this process end when its parent is killed, which then ends no others."""

    def watch() -> None:
        parent = mp.parent_process()
        assert parent is not None
        parent.join()
        os._exit(1)

    threading.Thread(target=watch, daemon=True).start()


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


def write(result: Result, out: Path) -> None:
    """Write evaluations.png and the scenes of the costliest steps into a folder."""
    write_figure(out / "evaluations.png", histogram(result), 150)
    for rank, cost in enumerate(result.costliest(_SCENES), 1):
        scene, *_ = start(result.seed, cost.episode, result.accuracy)
        head = f"# seed {result.seed}, episode {cost.episode}: {cost.evaluations} evaluations in "
        file = out / f"costliest_{rank:02}_episode_{cost.episode}.toml"
        write_text(file, f"{head}step {cost.step}\n{scene.to_toml()}")


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
        Path | None, typer.Option(parser=path, help="Folder for picture and scenes.")
    ] = None,
    only: Annotated[
        int | None,
        typer.Option(
            "--episode", min=0, max=10**12, help="Only this episode; show or write its scene."
        ),
    ] = None,
    as_json: JsonOption = False,
) -> None:
    """Simulate random scenes under random torques, and check every action.

    An episode is a random valid scene from its start, for 200 actions of 10 ms or to its end. The
    seed and the number of an episode determine it. The exit status is 1 if a number is not
    finite, an episode ends without a reason, a restored snapshot continues differently, the
    engine panics, an episode takes longer than a minute, or an action needs more than 50 times
    the median number of evaluations of the right-hand side.

    The folder given by --out receives evaluations.png (a histogram of the cost of actions) and
    costliest_*.toml, the scenes with the costliest actions.

    \b
    Ten million actions, the full check:
      python -m tests.campaigns.stress --steps 10_000_000 --out out/stress
    Repeat one episode and print its scene:
      python -m tests.campaigns.stress --seed 0 --episode 17
    """  # noqa: D301 (\b keeps the examples' line breaks)
    try:
        if out is not None:
            prepare_folder(out)
        if only is not None:
            done = run(seed, only, value(accuracy))
            scene, *_ = start(seed, only, value(accuracy))
            summary, text, passed = asdict(done), done.text(), not done.failures
            if out is None:
                typer.echo(scene.to_toml())
            else:
                write_text(out / f"episode_{only}.toml", scene.to_toml())
        else:
            with progress_bar(steps, "stress", "action") as bar:
                found = make(seed, steps, value(accuracy), jobs or os.cpu_count() or 1, bar.update)
            summary, text, passed = found.summary(), found.text(), found.passed
            if out is not None:
                write(found, out)
    except (ValueError, OSError) as error:
        fail(error)
    typer.echo(text)
    if as_json:
        typer.echo(json.dumps(summary, allow_nan=False))
    if not passed:
        raise typer.Exit(1)


if __name__ == "__main__":
    app()
