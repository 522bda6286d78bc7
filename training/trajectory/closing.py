"""Feedback along a step in the engine, and its closing as a linear-quadratic problem."""

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from skate_env import Simulator, _core
from skate_env.scenes import Mirror

from ..orbits.linear_quadratic import solve
from ..orbits.push_only import TICK
from .engine import DELAY, Reference, scene_of
from .solution import Solution

Array = NDArray[np.float64]
Law = Callable[[int, Array], Array]
"""Residual torques (16,) for a tick, from its number and q, v (38,)."""

# Weights of deviations: 1 for angles [1/rad2], of velocities [s2/rad2], of torques [1/(N m)2].
_VELOCITY, TORQUE = 0.003, 4e-5
DEVIATION = np.array([0.0, *[1.0] * 18, *[_VELOCITY] * 19])
# The same of the residual.
_END = np.array([0.0, *[1.0] * 18, *[0.01] * 19])
# Runs with feedback that follow a step; largest number of runs that close one; residual of a
# closed step (SI units).
_FOLLOWS, _ROUNDS, _CLOSED = 4, 12, 1e-12
# Parts of a change that are tried.
_PARTS = (1.0, 0.5, 0.2)
# Ticks that a step may take longer than its reference.
_LATE = 30
# Limits of torques while the engine is steered to the step, and while it is closed [N m].
_FREE_LIMIT, _LIMIT = 400.0, 200.0


@dataclass(frozen=True)
class Run:
    """A step in the engine.

    Attributes
    ----------
    states
        q and v before each tick (n, 38).
    torques
        Residual torques (n, 16) [N m].
    residual
        Mirrored end minus start, without y_0 (38,).
    swapped
        Whether it ended with the swap of the legs.
    """

    states: Array
    torques: Array
    residual: Array
    swapped: bool

    @property
    def largest(self) -> float:
        """Largest residual in SI units."""
        return float(np.abs(self.residual).max())


class Stepper:
    """The engine at the beginning of a step."""

    def __init__(self, step: Solution) -> None:
        self.sim: _core.Simulator = Simulator(scene_of(step))
        self.reference = Reference(step)
        first = self.reference.state(DELAY, 3)
        # The supporting foot is flat at y = 0.
        first[:3], first[20:22] = 0.0, 0.0
        self.sim.reset(first[:19], first[19:], "right")
        self.start = self.sim.snapshot()
        self.ticks = round(self.reference.duration / TICK)
        mirror = Mirror(self.sim.coordinate_names)
        self.mirror = np.zeros((38, 38))
        columns = np.stack([mirror(column) for column in np.eye(19)], axis=1)
        self.mirror[:19, :19] = self.mirror[19:, 19:] = columns

    def run(self, law: Law) -> Run:
        """Simulate to the swap of the legs, or a termination."""
        sim = self.sim
        sim.restore(self.start)
        leg, first = sim.support_leg, self.state
        states, torques = [], []
        for tick in range(self.ticks + _LATE):
            states.append(self.state)
            torques.append(law(tick, states[-1]))
            if not sim.advance((tick + 1) * TICK, torques[-1]) or sim.support_leg != leg:
                break
        residual = self.mirror @ self.state - first
        residual[0] = 0.0
        swapped = sim.support_leg != leg and len(states) > self.ticks // 2
        return Run(np.array(states), np.array(torques), residual, swapped)

    @property
    def state(self) -> Array:
        """The engine's q and v (38,)."""
        return np.concatenate([self.sim.q, self.sim.v])

    def displace(self, change: Array) -> None:
        """Move the start (38,)."""
        self.sim.restore(self.start)
        self.sim.displace(np.concatenate([change, np.zeros(4)]))
        self.start = self.sim.snapshot()

    def linearized(self, torques: Array) -> list[tuple[Array, Array]]:
        """Return derivatives (38, 38), (38, 16) of each tick until a termination."""
        sim, made = self.sim, []
        sim.restore(self.start)
        try:
            for tick, torque in enumerate(torques):
                end = (tick + 1) * TICK
                part = sim.linearize(torque, until=end)
                made.append((part.A[:38, :38], part.B[:38]))
                sim.advance(end, torque)
        except ValueError:
            # A termination.
            pass
        return made


def gains(
    parts: list[tuple[Array, Array]], end: Array, slope: Array | None = None
) -> tuple[list[Array], list[Array]]:
    """Solve the linear-quadratic problem of the ticks backward.

    Parameters
    ----------
    parts
        Derivatives of the ticks.
    end, slope
        Second and first derivative of half the cost of the last state (38, 38), (38,).

    Returns
    -------
    K, k
        The torques change by -K dx - k.
    """
    A, B = [A for A, _ in parts], [B for _, B in parts]
    slope = np.zeros(38) if slope is None else slope
    return solve(A, B, np.diag(DEVIATION), TORQUE * np.eye(16), end, slope)


def follow(stepper: Stepper) -> Run:
    """Follow the reference by contact state to the swap; the gains come from the runs before.

    Raises
    ------
    RuntimeError
        If the step does not reach the swap.
    """
    reference = stepper.reference
    K: list[Array] = [np.zeros((16, 38))] * stepper.ticks

    def law(tick: int, x: Array) -> Array:
        contact, time = stepper.sim.state_number, DELAY + tick * TICK
        off = x - reference.state(time, contact)
        off[0] = 0.0
        torque = reference.torque(time, contact) - K[min(tick, len(K) - 1)] @ off
        return np.clip(torque, -_FREE_LIMIT, _FREE_LIMIT)

    run = stepper.run(law)
    for _ in range(_FOLLOWS):
        made, _ = gains(stepper.linearized(run.torques), np.diag(DEVIATION))
        K = made + K[len(made) :]
        run = stepper.run(law)
    if not run.swapped:
        raise RuntimeError(f"the step ends after {len(run.torques)} of {stepper.ticks} ticks")
    return run


def close(stepper: Stepper, run: Run) -> Run:
    """Change torques and start until the mirrored end is the start.

    In each round the torques change as little as possible for a smaller residual, of which the
    weight grows, and the start moves to the mirrored end.

    Raises
    ------
    RuntimeError
        If the residual does not become small.
    """
    weight = 10.0 * _END
    for _ in range(_ROUNDS):
        end = stepper.mirror.T @ np.diag(weight) @ stepper.mirror
        slope = stepper.mirror.T @ (weight * run.residual)
        K, k = gains(stepper.linearized(run.torques), end, slope)
        steered = [stepper.run(_changed(run, K, [part * each for each in k])) for part in _PARTS]
        run = min((each for each in [run, *steered] if each.swapped), key=lambda each: each.largest)
        if run.largest < _CLOSED:
            return run
        start = stepper.start
        moved = [(run, start)]
        for part in _PARTS:
            stepper.start = start
            stepper.displace(part * run.residual)
            moved.append((stepper.run(_changed(run, K, [np.zeros(16)] * len(k))), stepper.start))
        swapped = [each for each in moved if each[0].swapped]
        run, stepper.start = min(swapped, key=lambda each: each[0].largest)
        weight *= 10.0
    raise RuntimeError(f"the step does not close: the residual is {run.largest:.1e}")


def _changed(run: Run, K: list[Array], k: list[Array]) -> Law:
    """Torques of a run, changed by the solution of `gains`."""

    def law(tick: int, x: Array) -> Array:
        at, gain = min(tick, len(run.torques) - 1), min(tick, len(K) - 1)
        off = x - run.states[at]
        off[0] = 0.0
        torque: Array = run.torques[at] - K[gain] @ off - k[gain]
        return torque.clip(-_LIMIT, _LIMIT)

    return law
