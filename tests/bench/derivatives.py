"""Cost of the derivatives of an action, and of a gradient over many actions."""

import copy
import time
from collections.abc import Callable, Iterator

import numpy as np

from skate_env import gradients
from skate_env._core import Simulator
from skate_env.scenes import load_scene
from skate_env.studies.fixtures import PAPER_DAMPED, name_of

from .sizes import Sizes
from .table import OURS, Entry, Group, measure

ACTION, ROLLOUT = "action", "100 actions"
SCENE = PAPER_DAMPED
# Times of the actions [s]: in double support, gliding, and with events of the free foot.
_TIMES = (0.0, 0.1, 0.2, 0.3, 0.35, 0.4)
_ACTIONS = 100
_TORQUE = 1.0


def derivatives(sizes: Sizes) -> Group:
    """Measure the derivatives by state and torques against the motion itself."""
    group = measure(
        "Derivatives", "one action or rollout", [*_action(), *_rollout()], sizes.long_rounds
    )
    group.notes = [
        f"Scene {name_of(SCENE)} at its accuracy, random torques of {_TORQUE:g} N m, one core. All "
        "derivatives of an action are the columns of A and B, by 42 numbers of the state and 16 "
        "torques. The gradient over a rollout keeps those of every action; docs/gradients.md."
    ]
    return group


def _action() -> Iterator[Entry]:
    sims = []
    for seconds in _TIMES:
        sim = Simulator(load_scene(SCENE))
        sim.advance(seconds)
        sims.append(sim)
    torque = np.random.default_rng(0).uniform(-_TORQUE, _TORQUE, len(sims[0].q) - 3)

    def motion() -> int:
        moved = [copy.copy(sim) for sim in sims]
        before = time.perf_counter_ns()
        for sim in moved:
            sim.step(torque)
        return time.perf_counter_ns() - before

    def linear() -> int:
        before = time.perf_counter_ns()
        for sim in sims:
            sim.linearize(torque)
        return time.perf_counter_ns() - before

    count = float(len(sims))
    where = f"in {len(sims)} states"
    yield Entry(ACTION, "motion", OURS, f"Simulator.step {where}", motion, count)
    what = f"Simulator.linearize {where}: motion, A and B"
    yield Entry(ACTION, "motion and all derivatives", OURS, what, linear, count)


def _rollout() -> Iterator[Entry]:
    start = Simulator(load_scene(SCENE))
    shape = (_ACTIONS, len(start.q) - 3)
    torques = np.random.default_rng(0).uniform(-_TORQUE, _TORQUE, shape)
    weights = np.ones((_ACTIONS + 1, len(start.state_vector())))

    def motion(sim: Simulator) -> None:
        for torque in torques:
            sim.step(torque)

    def gradient(sim: Simulator) -> None:
        gradients.rollout(sim, torques).vjp(weights)

    for label, what, run in (
        ("motion", f"{_ACTIONS} times Simulator.step", motion),
        ("motion and gradient", "gradients.rollout and vjp", gradient),
    ):

        def timed(run: Callable[[Simulator], None] = run) -> int:
            sim = copy.copy(start)
            before = time.perf_counter_ns()
            run(sim)
            return time.perf_counter_ns() - before

        yield Entry(ROLLOUT, label, OURS, what, timed)
