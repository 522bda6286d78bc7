"""The card of a gait: the values of all lines."""

import json
from collections.abc import Callable
from dataclasses import dataclass
from functools import cached_property
from typing import Any

from .._core import Scene, Simulator
from ..policies import OrbitPolicy, Policy
from ..scenes import replace
from . import robustness
from .lines import LINES
from .motion import Motion, skate
from .robustness import ACCURACIES, STARTS, Robustness
from .tables import ROBUSTNESS, TABLES


@dataclass(frozen=True)
class Card:
    """What a gait does.

    Attributes
    ----------
    name
        Of the scene, and of the policy if there is one.
    motion
        What was measured.
    runs
        Perturbed starts, by accuracy.
    """

    name: str
    motion: Motion
    runs: dict[str, Robustness]

    @cached_property
    def numbers(self) -> dict[str, float]:
        """Values of `LINES` by key."""
        return {line.key: line.measure(self.motion) for line in LINES}

    @cached_property
    def tables(self) -> dict[str, dict[str, float]]:
        """Values of `TABLES` by key, and by contact state, end of a sole, or joint."""
        return {line.key: line.measure(self.motion) for line in TABLES}

    @cached_property
    def robustness(self) -> dict[str, dict[str, float]]:
        """Values of `ROBUSTNESS` by key and accuracy."""
        return {
            line.key: {name: line.measure(run) for name, run in self.runs.items()}
            for line in ROBUSTNESS
        }


def measure(
    scene: Scene,
    name: str,
    steps: int,
    accuracy: Any,
    policy: Policy | OrbitPolicy | None,
    progress: Callable[[int], object],
) -> Card:
    """Measure a gait over up to ``steps`` steps; ``progress`` counts to `work`.

    Raises
    ------
    ValueError
        If the scene has no such accuracy, or the policy another observation.
    """
    scene = replace(scene, {"accuracy": accuracy})
    motion = skate(Simulator(scene), steps, policy and policy.on(scene), progress)
    progress(steps - motion.recording.steps.size)
    runs = {}
    for label, each in _accuracies(accuracy).items():
        runs[label] = robustness.measure(scene, steps, policy, each, progress)
    return Card(name, motion, runs)


def work(steps: int, accuracy: Any) -> int:
    """Units of progress of `measure`: steps and runs."""
    return steps + len(_accuracies(accuracy)) * (1 + STARTS)


def _accuracies(accuracy: Any) -> dict[str, Any]:
    """Accuracies of the runs by name, each once."""
    return {x if isinstance(x, str) else json.dumps(x): x for x in (accuracy, *ACCURACIES)}
