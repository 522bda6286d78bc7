"""Many episodes in several processes, the same ones whatever their number."""

import itertools
import multiprocessing as mp
import os
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

PATIENCE = 60.0
"""An episode that takes longer hangs [s of wall time]."""
MOST_RATIO = 50.0
"""The costliest step may cost so many times the median."""

# Episodes that a process takes at a time, and how many such shares wait for each process.
_SHARE, _QUEUE = 8, 3
# How often somebody looks for hangs [s].
_LOOK = 0.5


@dataclass(frozen=True)
class Cost:
    """The costliest step of an episode."""

    evaluations: int
    episode: int
    step: int


@dataclass
class Result:
    """What came of a campaign; all but `wall_time` is a function of seed, accuracy and steps."""

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
    """How many steps took 0, 1, 2, ... evaluations."""
    wall_time: float = 0.0

    def add(self, episode: Episode) -> None:
        """Count one more."""
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
        """Return the least number of evaluations that suffices for this share of the steps."""
        return int(np.searchsorted(np.cumsum(self.counts), share * self.steps))

    def costliest(self, number: int) -> list[Cost]:
        """Return the costliest steps, each from another episode."""
        return sorted(self.costs, key=lambda cost: (-cost.evaluations, cost.episode))[:number]

    @property
    def ratio(self) -> float:
        """The costliest step's evaluations as a multiple of the median."""
        return (self.counts.size - 1) / max(self.quantile(0.5), 1) if self.steps else 0.0

    @property
    def passed(self) -> bool:
        """Whether nothing failed, and no step cost too much."""
        return not self.failures and self.ratio <= MOST_RATIO


def make(
    seed: int,
    steps: int,
    accuracy: Accuracy,
    jobs: int,
    progress: Callable[[int], object] = lambda steps: None,
    patience: float = PATIENCE,
) -> Result:
    """Run episodes 0, 1, ... until they come to so many steps, or until one hangs.

    ``progress`` is called with the steps of every episode.

    Raises
    ------
    ValueError
        If there is no such accuracy.
    """
    draw_scene(np.random.default_rng(0), accuracy)
    result = Result(seed, accuracy)
    started = time.monotonic()
    # Fresh interpreters: a fork would copy the locks of the progress bar's thread.
    context = mp.get_context("spawn")
    seats = context.Array("d", [0.0, 0.0, np.inf] * jobs)
    taken = context.Value("i", 0)
    pool = ProcessPoolExecutor(jobs, context, initializer=_sit, initargs=(seats, taken))
    try:
        for episode in _episodes(pool, seed, accuracy, _QUEUE * jobs, seats, patience):
            result.add(episode)
            progress(len(episode.evaluations))
            if result.steps >= steps:
                break
    except _Stuck as stuck:
        result.failures += stuck.failures
    finally:
        _end(pool, seats)
    result.wall_time = time.monotonic() - started
    return result


class _Stuck(Exception):
    def __init__(self, kind: str, message: str, episodes: list[int]) -> None:
        self.failures = [Failure(kind, episode, 0, message) for episode in episodes]


def _episodes(
    pool: ProcessPoolExecutor,
    seed: int,
    accuracy: Accuracy,
    most: int,
    seats: "SynchronizedArray[float]",
    patience: float,
) -> Iterator[Episode]:
    """Run episodes without end; they come in order."""
    shares: deque[Future[list[Episode]]] = deque()
    for first in itertools.count(step=_SHARE):
        shares.append(pool.submit(_share, seed, first, accuracy))
        if len(shares) < most:
            continue
        while not wait([shares[0]], timeout=_LOOK).done:
            if hanging := _running(seats, patience):
                raise _Stuck("hang", f"takes longer than {patience} s", hanging)
        try:
            yield from shares.popleft().result()
        except BrokenProcessPool as broken:
            message = f"or another at the same time: {broken}"
            raise _Stuck("process died", message, _running(seats, 0.0)) from None


# In the parent: of each process its number, the episode it runs, and since when.
# In a process: where it notes that.
_seat: tuple["SynchronizedArray[float]", int] | None = None


def _sit(seats: "SynchronizedArray[float]", taken: "Synchronized[int]") -> None:
    global _seat
    with taken.get_lock():
        _seat = seats, 3 * taken.value
        taken.value += 1


def _note(episode: int, since: float) -> None:
    assert _seat is not None
    seats, at = _seat
    seats[at : at + 3] = [os.getpid(), episode, since]


def _share(seed: int, first: int, accuracy: Accuracy) -> list[Episode]:
    done = []
    for number in range(first, first + _SHARE):
        _note(number, time.monotonic())
        done.append(run(seed, number, accuracy))
        _note(number, np.inf)
    return done


def _running(seats: "SynchronizedArray[float]", longer: float) -> list[int]:
    """Episodes that have been running for longer."""
    now = time.monotonic()
    noted = np.reshape(seats[:], (-1, 3))
    return [int(episode) for _, episode, since in noted if now - since > longer]


def _end(pool: ProcessPoolExecutor, seats: "SynchronizedArray[float]") -> None:
    """Do not wait for what is still running; it may hang."""
    pool.shutdown(wait=False, cancel_futures=True)
    own = {int(process) for process in np.reshape(seats[:], (-1, 3))[:, 0]}
    for child in mp.active_children():
        if child.pid in own:
            child.kill()
