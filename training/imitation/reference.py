"""The step that is imitated, and the scene of the imitation."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from skate_env import Scene
from skate_env.scenes import replace

from ..orbits.push_only import TICK, load

Array = NDArray[np.float64]


@dataclass(frozen=True)
class Reference:
    """The closed step, every millisecond from its start to the swap of the legs.

    Attributes
    ----------
    q, v
        Coordinates and velocities (t, 19), with the supporting foot at y = 0.
    states
        Rows of Table 2 (t,).
    """

    q: Array
    v: Array
    states: NDArray[np.int64]

    @property
    def duration(self) -> float:
        """Time to the swap [s]."""
        return len(self.q) * TICK

    def at(self, time: Array) -> NDArray[np.int64]:
        """Rows for times since the swap (n,) [s]."""
        return np.minimum((time / TICK).astype(np.int64), len(self.q) - 1)


def reference() -> Reference:
    """Simulate the step."""
    sim, torques = load()
    leg, q, v, states = sim.support_leg, [], [], []
    for i, torque in enumerate(torques):
        if sim.support_leg != leg:
            break
        # Positions are relative to the present one.
        q.append(np.concatenate([[0.0], sim.q[1:]]))
        v.append(sim.v)
        states.append(sim.state_number)
        sim.advance((i + 1) * TICK, torque)
    return Reference(np.array(q), np.array(v), np.array(states))


def scene(step: Reference, feedforward: float, action_period: float) -> Scene:
    """Return the scene of the step that starts on it.

    Parameters
    ----------
    step
        The closed step.
    feedforward
        Factor of tau2, tau3, tau5 and tau6; the step itself has 0.2.
    action_period
        Duration of an action [s].
    """
    sim, _ = load()
    names = sim.coordinate_names
    changes = {
        "accuracy": "balanced",
        "control.action_period": action_period,
        "control.feedforward.scale": feedforward,
        "description": "Push-only ice, sole of 0.24 m; starts on the closed step of "
        "training/orbits/push_only.npz.",
    }
    # The foot's height and angle follow from its contact.
    start = {f"start.q.{name}": step.q[0, i] for i, name in enumerate(names) if i > 2}
    start |= {f"start.v.{name}": step.v[0, i] for i, name in enumerate(names) if i > 2}
    start["start.v.y0"] = step.v[0, 0]
    return replace(sim.scene, changes | {name: float(value) for name, value in start.items()})
