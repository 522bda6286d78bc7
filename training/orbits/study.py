"""All that `python -m training.orbits` tells about the orbit of a scene."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from skate_env._core import Scene
from skate_env.policies import OrbitPolicy, Policy

from . import close, forced, measure, parts
from .close import Orbit

Array = NDArray[np.float64]


@dataclass(frozen=True)
class Study:
    """An orbit with its multipliers and measurements.

    Attributes
    ----------
    orbit
        Closed orbit.
    multipliers
        Of a cycle (d,), in the tangent space without translation and memory that is not read;
        largest magnitude first.
    determinants
        Checks of the derivative.
    states
        Contact states of a cycle in order, without visits of less than 2 ms.
    slide
        Displacement of the supporting feet while sliding, in a cycle [m].
    margins
        Distances from another order of events.
    decay
        Over ten gait steps.
    returning
        Largest perturbations that return, a random direction each [rad, rad/s]; empty if the cycle
        has more than one step, residual torques, or a multiplier outside the unit circle.
    """

    orbit: Orbit
    multipliers: NDArray[np.complex128]
    determinants: parts.Determinants
    states: Sequence[int]
    slide: float
    margins: measure.Margins
    decay: measure.Decay
    returning: Sequence[float]


def study(
    scene: Scene, progress: Callable[[str], object], policy: Policy | OrbitPolicy | None = None
) -> Study:
    """Find and measure the orbit of a scene; ``progress`` receives what is done next.

    With a policy it is an orbit with residual torques, near the policy's motion.

    Raises
    ------
    ValueError
        If the scene's motion ends or has no orbit that is found, or its accuracy locates no events
        or has no derivatives.
    """
    accuracy = scene.get("accuracy")
    if accuracy == "fast" or (isinstance(accuracy, dict) and accuracy["method"] == "moreau"):
        raise ValueError(f"accuracy = {accuracy}: must locate events, such as reference")
    progress("search")
    orbit = close.find(scene) if policy is None else forced.find(scene, policy)
    multipliers = np.linalg.eigvals(orbit.derivative.P).astype(complex)
    multipliers = multipliers[np.argsort(-np.abs(multipliers), kind="stable")]
    progress("determinants")
    determinants = parts.check(orbit)
    progress("decay")
    decay = measure.decay(orbit)
    returning: list[float] = []
    free = orbit.start.torques is None
    if free and orbit.start.steps == 1 and abs(multipliers[0]) < 1.0:
        progress("perturbations")
        returning = [measure.returning(orbit, seed) for seed in range(measure.DIRECTIONS)]
    return Study(
        orbit,
        multipliers,
        determinants,
        measure.states(orbit),
        measure.slide(orbit),
        measure.margins(orbit),
        decay,
        returning,
    )
