"""A step of the collocation in the engine: its scene, and the reference by contact state."""

from typing import Any

import casadi as ca
import numpy as np
from numpy.typing import NDArray

from skate_env import Scene, load_scene
from skate_env.scenes import replace

from ..orbits.push_only import TICK
from .dynamics import PHASES, feedforward
from .robot import numbers
from .solution import Solution

Array = NDArray[np.float64]

# The step begins half a tick after the swap, so that the swap lies in the middle of a sample [s].
DELAY = 0.5 * TICK
# Phases by the contact of the free foot and the heel of the supporting foot.
_AIR, _HEEL, _FLAT, _ROLLING = (0,), (1,), (2,), (3, 4)
_PHASES_OF = [_AIR] * 5 + [_HEEL] * 8 + [_FLAT, _ROLLING] * 4
_LAW_OF = [None] + ["swing"] * 4 + ["landing"] * 8 + [None, "push"] * 4


def scene_of(step: Solution) -> Scene:
    """Return push-only ice with the foot, the lifting and the feedforward of a step."""
    toe, heel, _ = step.foot
    k_y, k_z, ahead, height = step.parameters.tolist()
    changes: dict[str, Any] = {
        "name": "push_only_order",
        "accuracy": "reference",
        "body.foot.toe": toe,
        "body.foot.heel": heel,
        "control.action_period": TICK,
        "control.lifting.K_p": [k_y, k_y, k_z],
        "control.lifting.ahead": ahead,
        "control.lifting.height": height,
        "control.feedforward.scale": step.scale,
        "control.feedforward.tau7_scale": 0.0,
    }
    return replace(load_scene("push_only"), changes)


class Reference:
    """Motion and torques of a step as functions of time and contact state.

    In a contact state only the part of the step with the same contacts is used, so that a late
    landing is not followed by torques of the phase after it.
    """

    def __init__(self, step: Solution) -> None:
        self._step = step
        cuts = step.cuts
        self.duration = float(cuts[-1])
        self._begin = {"swing": cuts[0], "landing": cuts[1], "push": cuts[3]}

    def state(self, time: float, contact: int) -> Array:
        """Return q and v (38,) at a time since the swap [s]."""
        phase, place = self._place(time, contact)
        return self._step.state(phase, place)

    def torque(self, time: float, contact: int) -> Array:
        """Return residual torques (16,) for the tick that begins at a time since the swap [s].

        The mean of the step's total torques, less the feedforward of the contact state. When the
        heel should lift, the torques of state 16 lift it, with the feedforward of state 15.
        """
        middle = time + 0.5 * TICK
        if _PHASES_OF[contact] == _FLAT and middle > self._step.cuts[3]:
            return self._step.torque(3, 0.0)
        places = [time + (i + 0.5) / 10.0 * TICK for i in range(10)]
        total = np.mean([self._total(*self._place(each, contact)) for each in places], axis=0)
        law = _LAW_OF[contact]
        since = middle - (self._begin[law] if law else 0.0)
        return np.asarray(total - self._feedforward(law, since))

    def _place(self, time: float, contact: int) -> tuple[int, float]:
        """Return the phase, and the part of its duration, nearest to a time in a contact state."""
        phases, cuts = _PHASES_OF[contact], self._step.cuts
        time = float(np.clip(time, cuts[phases[0]], cuts[phases[-1] + 1]))
        phase = next((p for p in phases if time <= cuts[p + 1]), phases[-1])
        return phase, (time - cuts[phase]) / self._step.durations[phase]

    def _total(self, phase: int, place: float) -> Array:
        law = PHASES[phase].law
        time = self._step.cuts[phase] + place * self._step.durations[phase]
        since = time - (self._begin[law] if law else 0.0)
        return self._step.torque(phase, place) + self._feedforward(law, since)

    def _feedforward(self, law: str | None, time: float) -> Array:
        torque = numbers(ca.evalf(feedforward(law, ca.SX(time))))[3:]
        return np.asarray(self._step.scale * torque)
