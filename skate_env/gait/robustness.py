"""Whether a gait survives perturbed starts and other accuracies."""

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import numpy as np

from .._core import Scene, Simulator
from ..replay import ResidualPolicy, record
from ..scenes import replace
from .contact import order_share
from .motion import ONLY_FIRST, orders_of

# Number of perturbed starts, with the seeds 0, 1, ..., and their disturbance [rad, rad/s].
STARTS, SIGMA = 20, 0.01
# Accuracies of these runs besides that of the card.
ACCURACIES: tuple[Any, ...] = (1e-7, "reference")


@dataclass(frozen=True)
class Robustness:
    """Runs of a scene at one accuracy.

    Attributes
    ----------
    asked
        Number of steps that every run was to make.
    steps
        Steps made from the scene's own start.
    survived
        Number of the perturbed starts that made all steps.
    in_order, in_order_standing
        Share of the complete steps from perturbed starts in the paper's order, and with state 1
        counted as 3; NaN without a step.
    """

    asked: int
    steps: int
    survived: int
    in_order: float
    in_order_standing: float


def measure(
    scene: Scene,
    steps: int,
    policy: ResidualPolicy | None,
    accuracy: Any,
    progress: Callable[[int], object],
) -> Robustness:
    """Simulate the scene's start and `STARTS` perturbed ones; ``progress(1)`` after each."""
    scene = replace(scene, {"accuracy": accuracy})
    made, orders = [], []
    for seed in (None, *range(STARTS)):
        sim = Simulator(scene)
        try:
            if seed is not None:
                sim.perturb(SIGMA, seed)
        except ValueError:  # No draw of this seed is a valid start.
            made.append(0)
        else:
            recording = record(sim, steps, every=ONLY_FIRST, policy=policy)
            made.append(int(recording.steps.size))
            if seed is not None:
                orders += orders_of(recording)
        progress(1)
    return Robustness(
        asked=steps,
        steps=made[0],
        survived=int(np.sum(np.array(made[1:]) >= steps)),
        in_order=order_share(orders, standing_as_sliding=False),
        in_order_standing=order_share(orders, standing_as_sliding=True),
    )
