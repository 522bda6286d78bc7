"""The simulation behind a film."""

from .._core import Simulator
from .recorder import LONGEST_STEP, ResidualPolicy
from .recording import Array

# Times closer to each other than this count as equal [s].
_SAME = 1e-9


class FilmRollout:
    """Simulation in whole actions from a simulator's present state, equal to a replay.

    Parameters
    ----------
    sim
        Simulator with the scene's controller, and the policy if there is one.
    policy
        Policy whose residual is constant over each action period.
    """

    def __init__(self, sim: Simulator, policy: ResidualPolicy | None = None) -> None:
        self._sim, self._policy = sim, policy
        self._begin = self._last_step = sim.time
        self._between = Simulator(sim.scene)
        self.steps = 0
        sim.take_steps()

    @property
    def termination(self) -> str | None:
        """Reason of the end, or None."""
        return self._sim.termination

    @property
    def motion_time(self) -> float:
        """Simulated time [s]."""
        return self._sim.time - self._begin

    def is_done(self, steps: int) -> bool:
        """Whether `steps` gait steps are made, the simulation has ended or makes no more steps."""
        waiting = self._sim.time - self._last_step
        return self.termination is not None or self.steps >= steps or waiting >= LONGEST_STEP

    def advance(self, time: float) -> Simulator:
        """Advance to a time [s] after the start; return a simulator in that or the final state."""
        sim, until = self._sim, self._begin + time
        while self.termination is None and sim.time + sim.action_period < until + _SAME:
            sim.step(self._residual())
            for step in sim.take_steps():
                self.steps += 1
                self._last_step = step["time"]
        if self.termination is not None or sim.time >= until - _SAME:
            return sim
        self._between.restore(sim.snapshot())
        self._between.advance(until, self._residual())
        return self._between

    def _residual(self) -> Array | None:
        return None if self._policy is None else self._policy.residual(self._sim)
