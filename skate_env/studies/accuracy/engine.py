"""Simulate, time and count the motions of the study in the engine."""

import math

import numpy as np

from ..._core import Scene, Simulator
from .. import timing
from ..motions.cases import Case
from ..timing import Block
from .outcome import Array, Outcome
from .settings import Setting

# Sample period of forces and gaps [s], rounded up to a multiple of a fixed step.
_SAMPLE_PERIOD = 0.005
_HEEL, _TOE = 2, 3


def run(case: Case, setting: Setting, start: int) -> Outcome:
    """Compute a motion in one call, and once more with stops that measure the constraints.

    Raises
    ------
    ValueError
        If the engine does not know the setting.
    """
    scene = case.with_accuracy(setting.accuracy)
    sim = begin(case, scene, start)
    first, begun = sim.state_number, sim.q[0]
    sim.advance(case.duration, case.torque)
    return outcome(sim, first, begun, _Violations.run(case, scene, setting, start))


def outcome(sim: Simulator, first: int, begun: float, seen: "_Violations | None") -> Outcome:
    """Collect the outcome of a simulation that started in state ``first`` at ``y0 = begun``."""
    events, stats, q = sim.take_events(), sim.stats(), sim.q
    return Outcome(
        time=sim.time,
        termination=sim.termination,
        q=q,
        v=sim.v,
        states=(first, *(event[3] for event in events)),
        event_times=tuple(event[0] for event in events),
        slide=float(q[0] - begun),
        energy_residual=stats.get("energy_residual"),
        drift=seen.drift if seen else None,
        penetration=seen.penetration if seen else None,
        pull=seen.pull if seen else None,
        cone_excess=seen.cone_excess if seen else None,
        stats={name: float(value) for name, value in stats.items()},
    )


def begin(case: Case, scene: Scene, start: int) -> Simulator:
    """Build a simulator at a start of the case."""
    sim = Simulator(scene)
    sim.reset(*case.start(start))
    return sim


def block(case: Case, setting: Setting) -> tuple[Block, float]:
    """Return a block that times the whole motion, and the motion's duration [s]."""
    sim = begin(case, case.with_accuracy(setting.accuracy), 0)
    work = timing.timed(lambda: sim.advance(case.duration, case.torque), sim.reset)
    return work, case.duration


class _Violations:
    """Largest constraint violations of a motion; None for laws that the scene does not have."""

    def __init__(self, scene: Scene) -> None:
        effects, numbers = scene.effects(), scene.parameters()
        self._push_only = effects["push_only"]
        self._mu: tuple[float, float] | None = None
        if "ice.friction.mu_forward" in numbers:
            forward = numbers["ice.friction.mu_forward"][0]
            self._mu = (forward, numbers["ice.friction.mu_backward"][0])
        self.drift = 0.0
        self.penetration = 0.0 if self._push_only else None
        self.pull = 0.0 if self._push_only else None
        self.cone_excess = 0.0 if self._mu else None

    @classmethod
    def run(cls, case: Case, scene: Scene, setting: Setting, start: int) -> "_Violations":
        """Repeat a motion with stops at multiples of a fixed step."""
        step = (setting.value if setting.fixed_step else None) or _SAMPLE_PERIOD
        period = step * math.ceil(_SAMPLE_PERIOD / step * (1.0 - 1e-9))
        violations, sim = cls(scene), begin(case, scene, start)
        number, going = 1, True
        while going and sim.time < case.duration:
            going = sim.advance(min(number * period, case.duration), case.torque)
            number += 1
            if going:
                violations.sample(sim)
        return violations

    def sample(self, sim: Simulator) -> None:
        position, _ = sim.violation()
        self.drift = max(self.drift, float(np.abs(position).max()))
        forces = sim.contact_forces
        if self.penetration is not None and self.pull is not None:
            self.penetration = max(self.penetration, -float(sim.gaps().min()))
            self.pull = max(self.pull, -float(forces[:, [_HEEL, _TOE]].min()))
        if self._mu is not None and self.cone_excess is not None:
            self.cone_excess = max(self.cone_excess, self._excess(forces, *self._mu))

    def _excess(self, forces: Array, forward: float, backward: float) -> float:
        """Return the force outside the cone; two-way contact has friction under pull, too."""
        along, normal = forces[:, 0], forces[:, 1]
        normal = np.maximum(normal, 0.0) if self._push_only else np.abs(normal)
        return float(np.maximum(-along - forward * normal, along - backward * normal).max())
