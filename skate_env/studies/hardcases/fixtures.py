"""Scenes that cases start from, and quantities that they measure."""

from collections.abc import Callable, Iterator
from typing import Any

import numpy as np

from ..._core import Scene, Simulator
from ..motions.cases import cases
from .case import Array, Unexpected

# Coordinates before the joints: y0, z0, q1.
ROOT = 3
GRAVITY = 9.81
STANCE = {"q2": 0.1, "q3": -0.2, "q5": 0.5, "q6": -0.9, "q7": 0.4}
"""Joint angles [rad]: one leg on the ice, the other in the air."""
ON_ONE_LEG: dict[str, Any] = {"support_leg": "right", "q": STANCE, "v": {}}
"""A scene's start in this posture, at rest."""
_HEEL = 2


def standing() -> Scene:
    """Scene of a robot on both straight legs, on the paper's ice, without a controller."""
    return Scene.from_toml('name = "standing"')


def coulomb(mu: float, capture_speed: float = 0.01) -> dict[str, Any]:
    """Return a scene's `ice.friction` with one coefficient and a capture speed [m/s]."""
    return {"kind": "coulomb", "mu": mu, "capture_speed": capture_speed}


def damped(scene: Scene, factor: float) -> Scene:
    """Copy a scene with the damping of all joints multiplied by a factor."""
    damping = {
        name: factor * value
        for name, (value, *_) in scene.parameters().items()
        if name.startswith("body.") and name.endswith(".damping")
    }
    return scene.with_values(damping)


def push_only(scene: Scene) -> Scene:
    """Copy a scene with push-only contact."""
    return scene.with_effect("push_only")


def motion(name: str) -> Scene:
    """Scene of a motion of the accuracy study."""
    return cases()[name].scene


def energy(sim: Simulator) -> float:
    """Kinetic and potential energy [J]."""
    return sum(sim.energy(sim.q, sim.v))


def kinetic(sim: Simulator) -> float:
    """Kinetic energy [J]."""
    return sim.energy(sim.q, sim.v)[0]


def weight(sim: Simulator) -> float:
    """Weight at 9.81 m/s2 [N]."""
    return float(sim.mass_matrix(np.zeros_like(sim.q))[1, 1]) * GRAVITY


def energy_residual(sim: Simulator) -> float:
    """Absolute energy residual since the reset [J]: energy change minus work and losses."""
    return abs(sim.stats()["energy_residual"])


def relative_residual(sim: Simulator, until: float) -> float:
    """Largest energy residual until a time, divided by the largest kinetic energy."""
    most, worst = kinetic(sim), 0.0
    for _ in sampled(sim, until):
        most, worst = max(most, kinetic(sim)), max(worst, energy_residual(sim))
    return worst / most


def force_violation(sim: Simulator) -> float:
    """Largest violation of Signorini's and Coulomb's laws by the contact forces [body weights]."""
    numbers = sim.scene.parameters()
    friction = "ice.friction.mu"
    forward = numbers.get(f"{friction}_forward", numbers.get(friction, (0.0,)))[0]
    backward = numbers.get(f"{friction}_backward", numbers.get(friction, (0.0,)))[0]
    worst = 0.0
    for along, normal, *ends in sim.contact_forces:
        worst = max(worst, -min(ends), along - backward * normal, -along - forward * normal)
    return worst / weight(sim)


def depth(sim: Simulator) -> float:
    """Depth of the lowest sole end below the ice [m]; 0 above it."""
    return max(0.0, -float(sim.gaps().min()))


def sampled(sim: Simulator, until: float, period: float = 0.01) -> Iterator[float]:
    """Advance in equal parts of about `period` [s]; yield the time after each until an end."""
    parts = round((until - sim.time) / period)
    start = sim.time
    for part in range(1, parts + 1):
        if not sim.advance(start + part * (until - start) / parts):
            return
        yield sim.time


def largest(sim: Simulator, until: float, measure: Callable[[Simulator], float]) -> float:
    """Largest value of `measure`, sampled every 10 ms until a time or an end."""
    return max((measure(sim) for _ in sampled(sim, until)), default=0.0)


def expect(condition: object, otherwise: str) -> None:
    """Raise `Unexpected` with a reason unless a condition holds."""
    if not condition:
        raise Unexpected(otherwise)


def state_distance(one: Simulator, other: Simulator) -> float:
    """Largest difference of two states [rad, m, rad/s, m/s]; inf if the contact states differ."""
    if (one.state_name, one.support_leg, one.termination) != (
        other.state_name,
        other.support_leg,
        other.termination,
    ):
        return float("inf")
    return float(max(abs(one.q - other.q).max(), abs(one.v - other.v).max()))


def finite(sim: Simulator) -> bool:
    """Whether all state, force and torque arrays are finite."""
    arrays: tuple[Array, ...] = (
        sim.q,
        sim.v,
        sim.acceleration,
        sim.contact_forces,
        sim.torque,
        sim.head_position,
    )
    return all(np.isfinite(values).all() for values in arrays)
