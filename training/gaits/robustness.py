"""Whether a gait survives perturbed starts and other accuracies."""

from collections.abc import Callable, Mapping
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass
from functools import partial
from typing import Any

from skate_env import Scene, Simulator
from skate_env.common import wilson
from skate_env.gait import orders_of
from skate_env.gait.contact import order_share
from skate_env.replay import Recording, record
from skate_env.scenes import replace

# Number of perturbed starts, with the seeds 0, 1, ..., and their disturbance [rad, rad/s].
STARTS, SIGMA = 256, 0.01
ACCURACIES = {"balanced": "balanced", "1e-07": 1e-7, "reference": "reference"}
# For `record`: no sample but the first, because only events and steps count.
ONLY_FIRST = 10**9


@dataclass(frozen=True)
class Robustness:
    """Runs of a scene.

    Attributes
    ----------
    made
        By accuracy, share of the steps asked for that are made from the scene's own start.
    survived, at_least, at_most
        Share of the perturbed starts that make all steps, and its interval of 95 %.
    in_order, in_order_standing
        Share of the complete steps from perturbed starts in the paper's order, and with state 1
        counted as 3; NaN without a step.
    """

    made: Mapping[str, float]
    survived: float
    at_least: float
    at_most: float
    in_order: float
    in_order_standing: float


def measure(scene: Scene, steps: int, progress: Callable[[int], object]) -> Robustness:
    """Simulate the scene's start at every accuracy, and `STARTS` perturbed ones at `balanced`."""
    runs = []
    own = {name: _run(scene, steps, each, None) for name, each in ACCURACIES.items()}
    with ThreadPoolExecutor() as pool:
        for run in pool.map(partial(_run, scene, steps, "balanced"), range(STARTS)):
            runs.append(run)
            progress(1)
    survived = sum(_steps(run) >= steps for run in runs)
    orders = [order for run in runs if run is not None for order in orders_of(run)]
    return Robustness(
        {name: _steps(run) / steps for name, run in own.items()},
        survived / STARTS,
        *wilson(survived, STARTS),
        in_order=order_share(orders, standing_as_sliding=False),
        in_order_standing=order_share(orders, standing_as_sliding=True),
    )


def _run(scene: Scene, steps: int, accuracy: Any, seed: int | None) -> Recording | None:
    """Simulate one start; None if no draw of the seed is a valid one."""
    sim = Simulator(replace(scene, {"accuracy": accuracy}))
    try:
        if seed is not None:
            sim.perturb(SIGMA, seed)
    except ValueError:
        return None
    return record(sim, steps, every=ONLY_FIRST)


def _steps(run: Recording | None) -> int:
    return 0 if run is None else int(run.steps.size)
