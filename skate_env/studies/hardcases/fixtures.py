"""Scenes that cases begin from, and what they look at."""

from collections.abc import Callable, Iterator
from typing import Any

import numpy as np

from ..._core import Scene, Simulator
from ..accuracy.cases import cases
from .case import Array, Unexpected

# Coordinates before the joints: y0, z0, q1.
ROOT = 3
GRAVITY = 9.81
STANCE = {"q2": 0.1, "q3": -0.2, "q5": 0.5, "q6": -0.9, "q7": 0.4}
"""One leg on the ice, the other in the air."""
ON_ONE_LEG: dict[str, Any] = {"support_leg": "right", "q": STANCE, "v": {}}
"""That as a scene's start, at rest."""
_HEEL = 2


def standing() -> Scene:
    """Stand on both straight legs, on the paper's ice, without a controller."""
    return Scene.from_toml('name = "standing"')


def pushing(scene: Scene) -> Scene:
    """Copy a scene with ice that only pushes."""
    return scene.with_effect("push_only")


def motion(name: str) -> Scene:
    """Take the scene of a motion of the accuracy study."""
    return cases()[name].scene


def energy(sim: Simulator) -> float:
    """Kinetic and potential [J]."""
    return sum(sim.energy(sim.q, sim.v))


def kinetic(sim: Simulator) -> float:
    """Kinetic energy [J]."""
    return sim.energy(sim.q, sim.v)[0]


def weight(sim: Simulator) -> float:
    """Weight under the usual gravity [N]."""
    return float(sim.mass_matrix(np.zeros_like(sim.q))[1, 1]) * GRAVITY


def unbooked(sim: Simulator) -> float:
    """Energy that nobody booked since the reset [J]."""
    return abs(sim.stats()["energy_residual"])


def unbooked_share(sim: Simulator, until: float) -> float:
    """Return the energy nobody booked at worst until a time, in the largest kinetic energy."""
    most, worst = kinetic(sim), 0.0
    for _ in ticks(sim, until):
        most, worst = max(most, kinetic(sim)), max(worst, unbooked(sim))
    return worst / most


def outside(sim: Simulator) -> float:
    """How far forces on the feet are outside what ice that only pushes can give, in weights."""
    numbers = sim.scene.parameters()
    friction = "ice.friction.mu"
    forward = numbers.get(f"{friction}_forward", numbers.get(friction, (0.0,)))[0]
    backward = numbers.get(f"{friction}_backward", numbers.get(friction, (0.0,)))[0]
    worst = 0.0
    for along, normal, *ends in sim.contact_forces:
        worst = max(worst, -min(ends), along - backward * normal, -along - forward * normal)
    return worst / weight(sim)


def depth(sim: Simulator) -> float:
    """How deep the lowest end of a sole is below the ice [m]."""
    return max(0.0, -float(sim.gaps().min()))


def ticks(sim: Simulator, until: float, period: float = 0.01) -> Iterator[float]:
    """Advance in equal parts, each yielded with its time, while the simulation goes on."""
    parts = round((until - sim.time) / period)
    start = sim.time
    for part in range(1, parts + 1):
        if not sim.advance(start + part * (until - start) / parts):
            return
        yield sim.time


def worst_of(sim: Simulator, until: float, look: Callable[[Simulator], float]) -> float:
    """Return the largest value seen every 10 ms until a time or an end."""
    return max((look(sim) for _ in ticks(sim, until)), default=0.0)


def expect(condition: object, otherwise: str) -> None:
    """Let the case fail with a reason unless a condition holds."""
    if not condition:
        raise Unexpected(otherwise)


def apart(one: Simulator, other: Simulator) -> float:
    """Largest difference of two states [rad, m; rad/s, m/s]; infinite in other contact states."""
    if (one.state_name, one.support_leg, one.termination) != (
        other.state_name,
        other.support_leg,
        other.termination,
    ):
        return float("inf")
    return float(max(abs(one.q - other.q).max(), abs(one.v - other.v).max()))


def finite(sim: Simulator) -> bool:
    """Tell whether everything that people can ask for is finite."""
    arrays: tuple[Array, ...] = (
        sim.q,
        sim.v,
        sim.acceleration,
        sim.contact_forces,
        sim.torque,
        sim.head_position,
    )
    return all(np.isfinite(values).all() for values in arrays)
