"""Whether a gait survives perturbed starts and other accuracies."""

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import numpy as np

from skate_env import Scene, Simulator
from skate_env.gait import orders_of
from skate_env.gait.contact import order_share
from skate_env.replay import record
from skate_env.scenes import replace

# Number of perturbed starts, with the seeds 0, 1, ..., and their disturbance [rad, rad/s].
STARTS, SIGMA = 20, 0.01
# For `record`: no sample but the first, because only events and steps count.
ONLY_FIRST = 10**9


@dataclass(frozen=True)
class Robustness:
    """Runs of a scene at one accuracy.

    Attributes
    ----------
    made
        Share of the steps asked for that are made from the scene's own start.
    survived
        Number of the perturbed starts that made all steps.
    in_order, in_order_standing
        Share of the complete steps from perturbed starts in the paper's order, and with state 1
        counted as 3; NaN without a step.
    """

    made: float
    survived: int
    in_order: float
    in_order_standing: float


def measure(
    scene: Scene, steps: int, accuracy: Any, progress: Callable[[int], object]
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
            recording = record(sim, steps, every=ONLY_FIRST)
            made.append(int(recording.steps.size))
            if seed is not None:
                orders += orders_of(recording)
        progress(1)
    return Robustness(
        made=made[0] / steps,
        survived=int(np.sum(np.array(made[1:]) >= steps)),
        in_order=order_share(orders, standing_as_sliding=False),
        in_order_standing=order_share(orders, standing_as_sliding=True),
    )
