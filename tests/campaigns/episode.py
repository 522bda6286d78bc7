"""One episode: a random scene under random torques, checked after every step."""

from collections.abc import Iterator
from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

from skate_env._core import Scene, Simulator
from skate_env.environments import PAPER_ACTIONS

from .draw import Accuracy, draw_scene, torque_scale

LONGEST = 200
"""Maximum number of steps of an episode."""
TIME_LIMIT = "time_limit"
"""End of an episode with the maximum number of steps."""

# Probability that an episode restores a snapshot once.
_RESTORED = 0.2


@dataclass(frozen=True)
class Failure:
    """A violated requirement: its kind, the episode and the step."""

    kind: str
    episode: int
    step: int
    message: str

    def text(self) -> str:
        """Format the failure for a terminal."""
        return f"FAILED: {self.kind}, episode {self.episode}, step {self.step}: {self.message}"


@dataclass
class Episode:
    """Results of an episode, a function of seed and number."""

    number: int
    end: str = TIME_LIMIT
    refused: int = 0
    time: float = 0.0
    evaluations: list[int] = field(default_factory=list)
    """Evaluations of the right-hand side of each step."""
    failures: list[Failure] = field(default_factory=list)

    def text(self) -> str:
        """Format the results for a terminal."""
        line = f"episode {self.number}: {len(self.evaluations)} steps, {self.end}"
        if self.evaluations:
            most = max(self.evaluations)
            step = self.evaluations.index(most)
            line += f", at most {most:,} evaluations per step (step {step})"
        return "\n".join([line, *(failure.text() for failure in self.failures)])


class Broken(Exception):
    """A requirement of `play` is violated."""

    def __init__(self, kind: str, message: str) -> None:
        super().__init__(message)
        self.kind = kind


def start(
    seed: int, number: int, accuracy: Accuracy
) -> tuple[Scene, Simulator, np.random.Generator, int]:
    """Draw scenes until one has a valid start.

    Returns the scene, its simulator, the random generator and the number of refused scenes.
    """
    rng = np.random.default_rng(np.random.SeedSequence([seed, number]))
    refused = 0
    while True:
        scene = draw_scene(rng, accuracy)
        try:
            return scene, Simulator(scene), rng, refused
        except ValueError:
            refused += 1


def play(sim: Simulator, rng: np.random.Generator) -> Iterator[int]:
    """Step with random torques to the end of the episode; yield the evaluations of each step.

    Raises
    ------
    Broken
        If a number is not finite, the time is wrong, an end has no name, or a restored snapshot
        continues differently.
    """
    joints = sim.coordinate_names[3:]
    scale = torque_scale(rng, np.array([PAPER_ACTIONS["action_scale"][joint] for joint in joints]))
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
        # A panic of the engine is not an Exception, and its class cannot be imported.
        if type(error).__name__ != "PanicException":
            raise
        episode.end = "panic"
        episode.failures.append(Failure("panic", number, len(episode.evaluations), str(error)))
    return episode


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
        raise Broken("wrong time", f"t = {sim.time} s instead of {due} s")
    if goes_on != (sim.termination is None):
        raise Broken("no name", f"step returns {goes_on}, termination is {sim.termination}")


def _check_restore(sim: Simulator, saved: bytes, torque: NDArray[np.float64]) -> None:
    once = sim.snapshot()
    sim.restore(saved)
    if sim.snapshot() != saved:
        raise Broken("restore", f"a snapshot at t = {sim.time} s changes when it is restored")
    sim.step(torque)
    if sim.snapshot() != once:
        raise Broken("restore", f"the step to t = {sim.time} s differs after restoring a snapshot")
