"""One step of the gait of a scene as a first guess of the collocation."""

from collections.abc import Sequence
from dataclasses import dataclass

import casadi as ca
import numpy as np
from numpy.typing import NDArray

from skate_env import Simulator, _core, load_scene

from .dynamics import PHASES, feedforward
from .robot import numbers
from .solution import POINTS, Solution

Array = NDArray[np.float64]

# Time after which the gait has settled [s]; time between an event and the states beside it [s].
_SETTLED, _BESIDE = 20.0, 1e-7


@dataclass(frozen=True)
class _Sample:
    state: Array
    force: Array


def first_guess(name: str, scale: float, intervals: Sequence[int]) -> Solution:
    """Return a step of a preset that skates in the paper's order.

    Residual torques replace the part of the feedforward that `scale` leaves out. `intervals` are
    those of the phases.
    """
    scene = load_scene(name)
    sim = Simulator(scene)
    sim.advance(_SETTLED)
    for leg in ("left", "right"):
        _until(sim, leg)
    begin, y = sim.time, sim.q[0]
    start = np.concatenate([sim.q, sim.v])
    start[0] = 0.0
    parts = _parts(sim, begin)
    states, forces, torques, durations = [], [], [], []
    for phase, (first, last), n in zip(PHASES, parts, intervals, strict=True):
        places = np.concatenate([(i + POINTS) / n for i in range(n)])
        made = [_sample(sim, first + (last - first) * place, last, y) for place in places]
        states.append(np.stack([one.state for one in made], axis=1))
        forces.append(np.stack([one.force for one in made], axis=1))
        missing = (1.0 - scale) * numbers(ca.evalf(feedforward(phase.law, ca.SX(0.0))))[3:]
        torques.append(np.repeat(missing[:, None], n + 1, axis=1))
        durations.append(last - first)
    values = scene.parameters()
    toe, heel, height = (values[f"body.foot.{part}"][0] for part in ("toe", "heel", "height"))
    names = [f"control.lifting.{part}" for part in ("K_p.1", "K_p.2", "ahead", "height")]
    parameters = [values[name][0] for name in (*names, "stabilizers.head_damping.y")]
    return Solution(
        durations=np.array(durations),
        parameters=np.array(parameters),
        start=start,
        foot=(toe, heel, height),
        scale=scale,
        states=states,
        forces=forces,
        torques=torques,
    )


def _until(sim: _core.Simulator, leg: str) -> None:
    while sim.support_leg != leg:
        sim.advance(sim.time + 5e-4)


def _parts(sim: _core.Simulator, begin: float) -> list[tuple[float, float]]:
    """Return the beginning and the end of each phase of the step that begins now [s]."""
    before = sim.snapshot()
    sim.take_events()
    _until(sim, "left" if sim.support_leg == "right" else "right")
    events = sim.take_events()
    sim.restore(before)
    changes = [(time, state) for time, _, old, state, _ in events if old != state]
    begins = [begin]
    for phase in PHASES[1:]:
        begins.append(next(time for time, state in changes if state == phase.state))
    ends = [*begins[1:], next(time for time, _ in changes if time > begins[-1])]
    return list(zip(begins, ends, strict=True))


def _sample(sim: _core.Simulator, time: float, last: float, y: float) -> _Sample:
    sim.advance(min(time, last - _BESIDE))
    state = np.concatenate([sim.q, sim.v])
    state[0] -= y
    loads = sim.contact_forces
    return _Sample(state, np.concatenate([loads[0, [2, 3, 0]], loads[1, [2, 3, 0]]]))
