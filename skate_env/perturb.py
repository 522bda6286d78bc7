"""Random starts near a scene's own."""

from numbers import Real

import numpy as np

from ._core import Simulator

# The free foot may begin right above the ice, so about half of all draws put it below.
_ATTEMPTS = 100
_LEG_JOINTS = ("q2", "q3", "q4", "q5", "q6", "q7")


def checked_sigma(sigma: float) -> float:
    """Return the size of a perturbation if it is one.

    Raises
    ------
    TypeError
        If it is not a number.
    ValueError
        If it is not a finite number of at least 0.
    """
    if isinstance(sigma, bool) or not isinstance(sigma, Real):
        kind = type(sigma).__name__
        raise TypeError(f"the perturbation is {sigma!r}: it must be a real number, not {kind}")
    if not 0.0 <= sigma < np.inf:
        raise ValueError(f"the perturbation is {sigma}: it must be a finite number, at least 0")
    return sigma


def perturbed_start(sim: Simulator, sigma: float, seed: int) -> None:
    """Reset a simulator to its scene's start, disturbed; the support stays flat on the ice.

    Normal noise is added to the leg angles q2 .. q7 (``sigma`` rad) and to their rates
    (``sigma`` rad/s), and the skating speed is multiplied by ``1 + sigma * n``. A start that
    would put the free foot below the ice is drawn again.

    Raises
    ------
    TypeError, ValueError
        As of `checked_sigma`; ValueError, too, if no draw gives a valid start.
    """
    checked_sigma(sigma)
    rng = np.random.default_rng(seed)
    sim.reset()
    q0, v0, leg = sim.q, sim.v, sim.support_leg
    names = sim.coordinate_names
    legs = [names.index(joint) for joint in _LEG_JOINTS]
    speed = names.index("y0")
    for _ in range(_ATTEMPTS):
        q, v = q0.copy(), v0.copy()
        q[legs] += sigma * rng.standard_normal(len(legs))
        v[legs] += sigma * rng.standard_normal(len(legs))
        v[speed] *= 1.0 + sigma * rng.standard_normal()
        try:
            sim.reset(q, v, leg)
        except ValueError:
            continue
        return
    raise ValueError(f"no start within {sigma} of the scene's lies above the ice")
