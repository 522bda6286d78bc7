"""One episode: a random scene from its start under random torques, watched after every step."""

from collections.abc import Iterator
from dataclasses import dataclass, field
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ..._core import Scene, Simulator
from ...env_config import TORQUE_SCALE
from .draw import draw_scene

LONGEST = 200
"""Most steps of an episode."""
TIME_LIMIT = "time_limit"
"""The end of an episode that makes all of them."""

# Shares of episodes without torques, with full actions, with others' multiples, the rest wild.
_SHARES = (0.15, 0.3, 0.45, 0.1)
# Ranges of such multiples and of wild torques [N m], logarithms to base ten.
_MULTIPLE, _WILD = (-2.0, 1.0), (3.0, 6.0)
# Share of episodes that go back once to a snapshot.
_RESTORED = 0.2

Accuracy = str | float | dict[str, Any]


@dataclass(frozen=True)
class Failure:
    """What must not happen: its kind, and where."""

    kind: str
    episode: int
    step: int
    message: str


@dataclass
class Episode:
    """What came of an episode; everything but wall time is a function of seed and number."""

    number: int
    end: str = TIME_LIMIT
    refused: int = 0
    time: float = 0.0
    evaluations: list[int] = field(default_factory=list)
    """Of the right-hand side, in each step."""
    failures: list[Failure] = field(default_factory=list)


class Broken(Exception):
    """A law of `play` does not hold."""

    def __init__(self, kind: str, message: str) -> None:
        super().__init__(message)
        self.kind = kind


def start(
    seed: int, number: int, accuracy: Accuracy
) -> tuple[Scene, Simulator, np.random.Generator, int]:
    """Draw scenes until one can start; also returns what draws next, and how many could not."""
    rng = np.random.default_rng(np.random.SeedSequence([seed, number]))
    refused = 0
    while True:
        scene = draw_scene(rng, accuracy)
        try:
            return scene, Simulator(scene), rng, refused
        except ValueError:
            refused += 1


def play(sim: Simulator, rng: np.random.Generator) -> Iterator[int]:
    """Step with random torques to the end of the episode; yields evaluations step by step.

    Raises
    ------
    Broken
        If a number is not finite, the time is not on its grid, an end has no name, or a snapshot
        does not continue as before.
    """
    joints = sim.coordinate_names[3:]
    scale = _scale(rng, np.array([TORQUE_SCALE[joint] for joint in joints]))
    restored = int(rng.integers(LONGEST)) if rng.random() < _RESTORED else None
    before = 0
    for i in range(LONGEST):
        torque = scale * rng.uniform(-1.0, 1.0, len(joints))
        saved = sim.snapshot() if i == restored else None
        goes_on = sim.step(torque)
        if saved is not None:
            _check_restore(sim, saved, torque)
        _check(sim, goes_on, (i + 1) * sim.action_period)
        after = int(sim.stats()["evaluations"])
        yield after - before
        before = after
        if not goes_on:
            return


def run(seed: int, number: int, accuracy: Accuracy) -> Episode:
    """Run one episode to its end, or to its first failure."""
    episode = Episode(number)
    try:
        _, sim, rng, episode.refused = start(seed, number, accuracy)
        for evaluations in play(sim, rng):
            episode.evaluations.append(evaluations)
        episode.end, episode.time = sim.termination or TIME_LIMIT, sim.time
    except Broken as broken:
        episode.end = broken.kind
        episode.failures.append(Failure(broken.kind, number, len(episode.evaluations), str(broken)))
    except BaseException as error:
        # A panic of the engine is no Exception, and its class has no name to import.
        if type(error).__name__ != "PanicException":
            raise
        episode.end = "panic"
        episode.failures.append(Failure("panic", number, len(episode.evaluations), str(error)))
    return episode


def _scale(rng: np.random.Generator, full: NDArray[np.float64]) -> NDArray[np.float64]:
    match rng.choice(len(_SHARES), p=_SHARES):
        case 0:
            return 0.0 * full
        case 1:
            return full
        case 2:
            return float(10.0 ** rng.uniform(*_MULTIPLE)) * full
        case _:
            return np.full(full.shape, 10.0 ** rng.uniform(*_WILD))


def _check(sim: Simulator, goes_on: bool, due: float) -> None:
    state = {"q": sim.q, "v": sim.v}
    if goes_on:
        state |= {
            "torque": sim.torque,
            "acceleration": sim.acceleration,
            "contact_forces": sim.contact_forces,
            "head_position": sim.head_position,
        }
    for name, values in state.items():
        if not np.isfinite(values).all():
            raise Broken("not finite", f"{name} = {values} at t = {sim.time} s")
    if goes_on and sim.time != due:
        raise Broken("off the grid", f"t = {sim.time} s instead of {due} s")
    if goes_on != (sim.termination is None):
        raise Broken("no name", f"step says {goes_on}, termination is {sim.termination}")


def _check_restore(sim: Simulator, saved: bytes, torque: NDArray[np.float64]) -> None:
    once = sim.snapshot()
    sim.restore(saved)
    if sim.snapshot() != saved:
        raise Broken("restore", f"a snapshot at t = {sim.time} s is another after restoring it")
    sim.step(torque)
    if sim.snapshot() != once:
        raise Broken("restore", f"another motion to t = {sim.time} s after restoring a snapshot")
