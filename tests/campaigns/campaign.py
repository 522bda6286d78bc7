"""Many episodes in several processes; the results do not depend on the number of processes."""

import itertools
import multiprocessing as mp
import os
import threading
import time
from collections import Counter, deque
from collections.abc import Callable, Iterator
from concurrent.futures import Future, ProcessPoolExecutor, wait
from concurrent.futures.process import BrokenProcessPool
from dataclasses import dataclass, field
from multiprocessing.sharedctypes import Synchronized, SynchronizedArray

import numpy as np
from numpy.typing import NDArray

from .draw import draw_scene
from .episode import Accuracy, Episode, Failure, run

TIMEOUT = 60.0
"""Wall time after which an episode counts as hanging [s]."""
MOST_RATIO = 50.0
"""Largest ratio of the costliest step to the median that passes."""

# Episodes per task, and queued tasks per process.
_TASK_SIZE, _QUEUE = 8, 3
# Interval of the checks for hanging episodes [s].
_CHECK_INTERVAL = 0.5


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
    started = time.monotonic()
    # Fresh interpreters: a fork would copy the locks of the progress bar's thread.
    context = mp.get_context("spawn")
    records = context.Array("d", [0.0, 0.0, np.inf] * jobs)
    taken = context.Value("i", 0)
    pool = ProcessPoolExecutor(jobs, context, initializer=_register, initargs=(records, taken))
    try:
        for episode in _episodes(pool, seed, accuracy, _QUEUE * jobs, records, timeout):
            result.add(episode)
            progress(len(episode.evaluations))
            if result.steps >= steps:
                break
    except _Stopped as stopped:
        result.failures += stopped.failures
    finally:
        _end(pool, records)
    result.wall_time = time.monotonic() - started
    return result


class _Stopped(Exception):
    def __init__(self, kind: str, message: str, episodes: list[int]) -> None:
        self.failures = [Failure(kind, episode, 0, message) for episode in episodes]


def _episodes(
    pool: ProcessPoolExecutor,
    seed: int,
    accuracy: Accuracy,
    most: int,
    records: "SynchronizedArray[float]",
    timeout: float,
) -> Iterator[Episode]:
    """Yield all episodes in order, without end."""
    tasks: deque[Future[list[Episode]]] = deque()
    for first in itertools.count(step=_TASK_SIZE):
        tasks.append(pool.submit(_run_task, seed, first, accuracy))
        if len(tasks) < most:
            continue
        while not wait([tasks[0]], timeout=_CHECK_INTERVAL).done:
            if hanging := _running(records, timeout):
                raise _Stopped("hang", f"takes longer than {timeout} s", hanging)
        try:
            yield from tasks.popleft().result()
        except BrokenProcessPool as broken:
            message = f"or another at the same time: {broken}"
            raise _Stopped("process died", message, _running(records, 0.0)) from None


# Shared records of the processes (process id, episode, start time), and the offset of this process.
_record: tuple["SynchronizedArray[float]", int] | None = None


def _register(records: "SynchronizedArray[float]", taken: "Synchronized[int]") -> None:
    global _record
    threading.Thread(target=_end_with_parent, daemon=True).start()
    with taken.get_lock():
        _record = records, 3 * taken.value
        taken.value += 1


def _end_with_parent() -> None:
    """End this process when its parent is killed, which then ends no others."""
    parent = mp.parent_process()
    assert parent is not None
    parent.join()
    os._exit(1)


def _set_record(episode: int, since: float) -> None:
    assert _record is not None
    records, at = _record
    records[at : at + 3] = [os.getpid(), episode, since]


def _run_task(seed: int, first: int, accuracy: Accuracy) -> list[Episode]:
    done = []
    for number in range(first, first + _TASK_SIZE):
        _set_record(number, time.monotonic())
        done.append(run(seed, number, accuracy))
        _set_record(number, np.inf)
    return done


def _running(records: "SynchronizedArray[float]", longer: float) -> list[int]:
    """Return the episodes that have been running for longer [s]."""
    now = time.monotonic()
    rows = np.reshape(records[:], (-1, 3))
    return [int(episode) for _, episode, since in rows if now - since > longer]


def _end(pool: ProcessPoolExecutor, records: "SynchronizedArray[float]") -> None:
    """Stop the processes without waiting for episodes, which may hang."""
    pool.shutdown(wait=False, cancel_futures=True)
    own = {int(process) for process in np.reshape(records[:], (-1, 3))[:, 0]}
    for child in mp.active_children():
        if child.pid in own:
            child.kill()
