"""States for evaluations and steps, taken from perturbed episodes."""

from collections.abc import Iterator
from copy import copy
from dataclasses import dataclass

import numpy as np

from skate_env._core import Simulator
from skate_env.scenes import load_scene, replace
from skate_env.studies.fixtures import BLADE

STEP = 0.0025
"""Timestep of the timed steps and of MuJoCo's environment: the shorter of `fast` [s]."""
PERIOD = 0.01
"""Action period [s]."""

_SEEDS, _DISTURBANCE, _DURATION = 40, 0.02, 1.5
# Minimum number of steps between two states of an episode.
_SPACING = 12
# A sole end within this distance is on the ice [m].
_ON_ICE = 1e-9


@dataclass(frozen=True)
class Kind:
    """A kind of contact state."""

    name: str
    scene: str
    states: tuple[str, ...]
    """Names of the contact states."""
    landing: bool = False
    """Whether the free heel lands in the next step."""


EVALUATED = (
    Kind("flight", "push_only", ("air/air",)),
    Kind("gliding", "paper_printed", ("slide_flat/air",)),
    Kind("free heel down", BLADE, ("stick_flat/slide_heel", "slide_flat/slide_heel")),
    Kind("free foot flat", "paper_printed", ("slide_roll_toe/slide_flat",)),
)
"""Kinds for evaluations."""

STEPPED = (
    Kind("flight", "push_only", ("air/air",)),
    Kind("gliding", "paper_printed", ("slide_flat/air",)),
    Kind("landing", "paper_printed", ("slide_flat/air",), landing=True),
)
"""Kinds for steps."""


def find(kind: Kind, count: int, accuracy: str) -> list[Simulator]:
    """Find states of a kind in which the ice pushes every sole end in contact.

    Unless the free heel lands, the contact state lasts for at least one `PERIOD`.
    """
    found: list[Simulator] = []
    for sim in _candidates(kind, accuracy):
        found.append(sim)
        if len(found) == count:
            return found
    raise RuntimeError(f"{len(found)} states of {kind.name} in {kind.scene}; wanted {count}")


def _candidates(kind: Kind, accuracy: str) -> Iterator[Simulator]:
    changes = {"accuracy": accuracy, "control.action_period": STEP}
    scene = replace(load_scene(kind.scene), changes)
    for seed in range(_SEEDS):
        sim = Simulator(scene)
        sim.perturb(_DISTURBANCE, seed)
        wait = 0
        for _ in range(round(_DURATION / STEP)):
            wait -= 1
            if wait < 0 and sim.state_name in kind.states and _fits(sim, kind):
                yield copy(sim)
                wait = _SPACING
            if not sim.step():
                break


def _fits(sim: Simulator, kind: Kind) -> bool:
    heel, toe = sim.gaps()[0]
    if heel < _ON_ICE <= toe or touching(sim) != (np.abs(sim.gaps()) < _ON_ICE).sum():
        return False
    ahead = copy(sim)
    if kind.landing:
        return ahead.step() and any(
            what == "free heel lands" for _, what, *_ in ahead.take_events()
        )
    loads = sim.contact_forces[:, 2:]
    if (loads < 0.0).any() or (loads > 0.0).sum() != touching(sim):
        return False
    return all(
        ahead.step() and ahead.state_name == sim.state_name for _ in range(round(PERIOD / STEP))
    )


def touching(sim: Simulator) -> int:
    """Return the number of sole ends on the ice, or below it like the paper's free toe."""
    return int((sim.gaps() < _ON_ICE).sum())
