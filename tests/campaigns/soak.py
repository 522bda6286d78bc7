"""``python -m tests.campaigns.soak``: a long run of vector environments over random scenes."""

import ctypes
import gc
import itertools
import json
import os
import time
from collections import Counter
from collections.abc import Callable
from dataclasses import asdict, dataclass, field
from pathlib import Path
from typing import Annotated, Any

import numpy as np
import typer

from skate_env.cli.options import (
    MOST_JOBS,
    JsonOption,
    ScenesAccuracyOption,
    ScenesSeedOption,
    fail,
    value,
)
from skate_env.common import progress_bar
from skate_env.environments import PAPER_ACTIONS, IceSkateVectorEnv
from skate_env.environments import joints as movable

from .draw import Accuracy, draw_scene, torque_scale
from .episode import LONGEST, TIME_LIMIT, Failure

ACTIONS = 500
"""Largest number of actions of every environment of a scene."""
EPISODES = 5
"""Mean number of episodes per environment that end a scene, so that none ends all the time."""
MOST_GROWTH = 0.01
"""Largest relative growth of the resident memory that passes."""
LEAST_SCENES = 500
"""Fewest scenes whose memory is judged: at first the allocator takes pieces as large as a batch."""

# Standard deviation of the starts, in half of the scenes [rad, rad/s].
_PERTURBED = 0.02
_STATM = Path("/proc/self/statm")


@dataclass
class Result:
    """Results of a run. Time and memory depend on the machine, the rest on the arguments only."""

    seed: int
    accuracy: Accuracy
    environments: int
    steps: int = 0
    """Actions of single environments."""
    scenes: int = 0
    refused: int = 0
    """Scenes without a valid start."""
    ends: Counter[str] = field(default_factory=Counter)
    failures: list[Failure] = field(default_factory=list)
    memory: list[int] = field(default_factory=list)
    """Resident memory after every scene, see `resident` [bytes]; empty where it is not known."""
    wall_time: float = 0.0

    @property
    def growth(self) -> float:
        """Relative growth of the median memory from the second quarter of the run to the last.

        NaN for fewer than 500 scenes.
        """
        quarter = len(self.memory) // 4
        if len(self.memory) < LEAST_SCENES:
            return float("nan")
        before, after = self.memory[quarter : 2 * quarter], self.memory[-quarter:]
        return float(np.median(after) / np.median(before)) - 1.0

    @property
    def passed(self) -> bool:
        """Whether all numbers were finite and the memory did not grow."""
        return not self.failures and not self.growth > MOST_GROWTH

    def summary(self) -> dict[str, Any]:
        """Return the results as JSON values; times in s, memory in bytes."""
        return asdict(self) | {
            "ends": dict(sorted(self.ends.items())),
            "memory": self.memory[-1] if self.memory else None,
            "growth": None if np.isnan(self.growth) else self.growth,
            "passed": self.passed,
        }

    def text(self) -> str:
        """Format the results for a terminal."""
        rate = self.steps / max(self.wall_time, 1e-9)
        ends = ", ".join(f"{end} {count:,}" for end, count in self.ends.most_common())
        memory = f"{self.memory[-1] / 2**20:,.0f} MB" if self.memory else "not known"
        growth = f"{self.growth:+.2%} from the second quarter to the last"
        if np.isnan(self.growth):
            growth = f"growth not judged below {LEAST_SCENES} scenes"
        lines = [
            f"steps: {self.steps:,} in {self.scenes:,} scenes, {rate:,.0f} per second; "
            f"{self.refused:,} refused scenes",
            f"episodes: {self.ends.total():,}: {ends}",
            f"resident memory: {memory}, {growth}",
            *(failure.text() for failure in self.failures),
        ]
        if self.growth > MOST_GROWTH:
            lines.append(f"FAILED: the memory grows by more than {MOST_GROWTH:.0%}")
        return "\n".join(lines)


def make(
    seed: int,
    steps: int,
    accuracy: Accuracy,
    environments: int,
    threads: int,
    progress: Callable[[int], object] = lambda steps: None,
) -> Result:
    """Run scenes 0, 1, ... until they have `steps` actions of single environments in total.

    ``progress`` is called with the number of these after every scene.

    Raises
    ------
    ValueError
        If the accuracy is unknown.
    """
    draw_scene(np.random.default_rng(0), accuracy)
    result = Result(seed, accuracy, environments)
    started = time.monotonic()
    for number in itertools.count():
        before = result.steps
        _scene(result, number, threads)
        if (memory := resident()) is not None:
            result.memory.append(memory)
        progress(result.steps - before)
        if result.steps >= steps or result.failures:
            break
    result.wall_time = time.monotonic() - started
    return result


def resident() -> int | None:
    """Return the resident memory of the process [bytes], or None where the system does not tell it.

    Free pages do not count where the allocator is glibc's: it keeps some at random, so that a run
    without a leak may seem to grow. ``malloc_trim`` gives them back.
    """
    if not _STATM.exists():
        return None
    gc.collect()
    trim = getattr(ctypes.CDLL(None), "malloc_trim", None)
    if trim is not None:
        trim(0)
    return int(_STATM.read_text().split()[1]) * os.sysconf("SC_PAGE_SIZE")


def _scene(result: Result, number: int, threads: int) -> None:
    """Run all environments of one scene and add what happens."""
    rng = np.random.default_rng(np.random.SeedSequence([result.seed, number]))
    scene = draw_scene(rng, result.accuracy)
    scales = PAPER_ACTIONS["action_scale"]
    joints = movable(scene)
    scale = torque_scale(rng, np.array([scales[joint] for joint in joints]))
    try:
        envs = IceSkateVectorEnv(
            result.environments,
            scene,
            max_episode_steps=LONGEST,
            autoreset_mode="SameStep",
            num_threads=threads,
            joints=joints,
            action_scale=dict(zip(joints, scale.tolist(), strict=True)),
            mirrored=bool(rng.integers(2)),
            perturb=_PERTURBED * float(rng.integers(2)),
        )
        envs.reset(seed=int(rng.integers(2**31)))
    except ValueError:
        result.refused += 1
        return
    result.scenes += 1
    done = result.ends.total()
    for i in range(ACTIONS):
        if result.ends.total() - done >= EPISODES * result.environments:
            return
        actions = rng.uniform(-1.0, 1.0, envs.action_space.shape).astype(np.float32)
        observations, rewards, _, _, infos = envs.step(actions)
        result.steps += result.environments
        rows = [observations, rewards[:, np.newaxis]]
        if final := infos.get("final_info"):
            ended = infos["_final_info"]
            result.ends.update(end or TIME_LIMIT for end in final["termination"][ended])
            rows.append(np.stack(infos["final_obs"][ended]))
        if not all(np.isfinite(row).all() for row in rows):
            message = "an observation or a reward"
            result.failures.append(Failure("not finite", number, i, message))
            return


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
    cores = threads or os.cpu_count() or 1
    try:
        with progress_bar(steps, "soak", "action") as bar:
            result = make(seed, steps, value(accuracy), environments, cores, bar.update)
    except (ValueError, OSError) as error:
        fail(error)
    typer.echo(result.text())
    if as_json:
        typer.echo(json.dumps(result.summary(), allow_nan=False))
    if not result.passed:
        raise typer.Exit(1)


if __name__ == "__main__":
    app()
