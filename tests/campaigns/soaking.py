"""A long run of vector environments over random scenes: finite numbers, memory, ends, times."""

import ctypes
import gc
import itertools
import os
import time
from collections import Counter
from collections.abc import Callable
from dataclasses import asdict, dataclass, field
from pathlib import Path
from typing import Any

import numpy as np

from skate_env.environments import PAPER_ACTIONS, IceSkateVectorEnv
from skate_env.environments import joints as movable

from .draw import draw_scene
from .episode import LONGEST, TIME_LIMIT, Accuracy, Failure, torque_scale

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
    """Results of a run. Times and memory depend on the machine, the rest on the arguments only."""

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
    longest: tuple[float, int, int] = (0.0, 0, 0)
    """Wall time of the longest action of all environments [s], its scene and its number."""
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
        since = time.perf_counter()
        observations, rewards, _, _, infos = envs.step(actions)
        result.longest = max(result.longest, (time.perf_counter() - since, number, i))
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


def summary(result: Result) -> dict[str, Any]:
    """Return the results of a run as JSON values; times in s, memory in bytes."""
    seconds, scene, action = result.longest
    said = asdict(result) | {"ends": dict(sorted(result.ends.items()))}
    said["longest"] = {"seconds": seconds, "scene": scene, "action": action}
    said["memory"] = result.memory[-1] if result.memory else None
    growth = None if np.isnan(result.growth) else result.growth
    return said | {"growth": growth, "passed": result.passed}


def text(result: Result) -> str:
    """Format the results of a run for a terminal."""
    rate = result.steps / max(result.wall_time, 1e-9)
    episodes = max(sum(result.ends.values()), 1)
    ends = (f"{end} {count / episodes:.2%}" for end, count in result.ends.most_common())
    seconds, scene, action = result.longest
    growth = f", {result.growth:+.2%} from the second quarter to the last"
    if np.isnan(result.growth):
        growth = f"; growth: not judged below {LEAST_SCENES} scenes"
    memory = f"{result.memory[-1] / 2**20:,.0f} MB" if result.memory else "not known"
    rows = [
        ("steps", f"{result.steps:,} in {result.scenes:,} scenes, {rate:,.0f} per second"),
        ("refused scenes", f"{result.refused:,}"),
        ("episodes", f"{sum(result.ends.values()):,}: {', '.join(ends)}"),
        ("longest action", f"{seconds:.3g} s for all environments: scene {scene}, action {action}"),
        ("resident memory", f"{memory}{growth}"),
    ]
    lines = [f"{name:<20}{value}" for name, value in rows]
    for failure in result.failures:
        where = f"scene {failure.episode}, action {failure.step}"
        lines.append(f"FAILED: {failure.kind}, {where}: {failure.message}")
    if result.growth > MOST_GROWTH:
        lines.append(f"FAILED: the memory grows by more than {MOST_GROWTH:.0%}")
    return "\n".join(lines)
