"""Cost of the derivatives of an action, and of a gradient over many actions."""

import copy
from collections.abc import Iterator

import numpy as np

from skate_env import gradients
from skate_env._core import Simulator
from skate_env.scenes import load_scene
from skate_env.studies.fixtures import PAPER_DAMPED, name_of
from skate_env.studies.timing import timed

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

    moved = [copy.copy(sim) for sim in sims]
    saved = [sim.snapshot() for sim in sims]

    def restore() -> None:
        for sim, state in zip(moved, saved, strict=True):
            sim.restore(state)

    def motion() -> None:
        for sim in moved:
            sim.step(torque)

    def linear() -> None:
        for sim in sims:
            sim.linearize(torque)

    count = float(len(sims))
    where = f"in {len(sims)} states"
    yield Entry(ACTION, "motion", OURS, f"Simulator.step {where}", timed(motion, restore), count)
    what = f"Simulator.linearize {where}: motion, A and B"
    yield Entry(ACTION, "motion and all derivatives", OURS, what, timed(linear), count)


def _rollout() -> Iterator[Entry]:
    sim = Simulator(load_scene(SCENE))
    saved = sim.snapshot()
    shape = (_ACTIONS, len(sim.q) - 3)
    torques = np.random.default_rng(0).uniform(-_TORQUE, _TORQUE, shape)
    weights = np.ones((_ACTIONS + 1, len(sim.state_vector())))

    def restore() -> None:
        sim.restore(saved)

    def motion() -> None:
        for torque in torques:
            sim.step(torque)

    def gradient() -> None:
        gradients.rollout(sim, torques).vjp(weights)

    for label, what, run in (
        ("motion", f"{_ACTIONS} times Simulator.step", motion),
        ("motion and gradient", "gradients.rollout and vjp", gradient),
    ):
        yield Entry(ROLLOUT, label, OURS, what, timed(run, restore))
