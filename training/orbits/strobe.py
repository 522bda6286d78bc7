"""The stroboscopic map of a gait: the state after a whole number of the controller's samples.

The samples are at multiples of their period, so that a motion is not autonomous: it is periodic if
it repeats after a whole number of samples. The map takes the state at a sample to that after
``samples`` periods. In the engine's coordinates the legs are numbered from the supporting foot, so
that one gait step is half a cycle of the robot; after an odd number of steps the trunk and the arms
are mirrored.

States are relative: the supporting foot is at y = 0, the anchor counts from it, and the times t_0,
t_1, t_2 count from the present time.

A motion may have periodic residual torques, as that of a learned policy: they are held over actions
of a whole number of samples, and are part of the map.
"""

import math
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from skate_env._core import Scene, Simulator
from skate_env.scenes import Mirror

Array = NDArray[np.float64]

SAMPLE_PERIOD = "control.sample_period"
# Singular values of directions that the reduction maps to zero.
_NULL = 1e-8
# Torques of the legs, from the supporting ankle to the free one.
_LEGS = slice(0, 6)
# Part of a sample by which the time may deviate from a multiple of the period by rounding.
_ROUNDING = 1e-7
# Memory (anchor, t0, t1, t2) without a column in the map above this is not read.
_UNREAD = 1e-12


@dataclass(frozen=True)
class Start:
    """A state at a sample of the controller, from which a cycle of gait steps starts.

    Attributes
    ----------
    snapshot
        Of the simulator.
    tick
        Number of the sample.
    period
        Of the samples [s].
    steps
        Gait steps of a cycle.
    samples
        Samples of a cycle.
    torques
        Residual torques of the actions of a cycle (k, joints) [N m], each held for ``samples / k``
        samples, in the joints as they are numbered at the start of the cycle; None for the scene's
        controller alone.
    leg
        With torques: the supporting leg.
    """

    snapshot: bytes
    tick: int
    period: float
    steps: int
    samples: int
    torques: Array | None = None
    leg: str = "right"

    @property
    def duration(self) -> float:
        """Of a cycle [s]."""
        return self.samples * self.period

    def ends(self) -> list[float]:
        """Return the times at which the parts of a cycle end, one part for each gait step [s]."""
        ticks = [self.tick + self.samples * (i + 1) // self.steps for i in range(self.steps)]
        return [tick * self.period for tick in ticks]


@dataclass(frozen=True)
class Flow:
    """Linearization of a motion with piecewise constant residual torques.

    Attributes
    ----------
    tangent_before, events, nonsmooth
        As those of a `Linearization`, of the whole motion.
    A
        (s, s): from the state at its start to that at its end.
    B
        (s, joints): from a torque that is added throughout.
    """

    A: Array
    B: Array
    tangent_before: Array
    events: list[dict[str, Any]]
    nonsmooth: list[tuple[str, float, float]]


@dataclass(frozen=True)
class Derivative:
    """Derivative of a cycle in the reduced tangent space, of dimension d.

    Attributes
    ----------
    P
        (d, d): from the start to the end, mirrored back.
    basis
        Orthonormal (s, d), of relative states.
    unread
        Indices of memory that the motion neither reads nor writes; not part of the space.
    parts
        Linearizations, one for each gait step.
    """

    P: Array
    basis: Array
    unread: Sequence[int]
    parts: Sequence[Flow]

    @property
    def kept(self) -> Array:
        """Indices of the states whose return is required."""
        return np.delete(np.arange(len(self.basis)), list(self.unread))


class Strobe:
    """The stroboscopic map of a scene.

    Parameters
    ----------
    scene
        With an accuracy that `Simulator.linearize` accepts.
    """

    def __init__(self, scene: Scene) -> None:
        self.scene = scene
        self.sim = Simulator(scene)
        self.period = scene.parameters()[SAMPLE_PERIOD][0]
        self.n = n = len(self.sim.q)
        mirror = Mirror(self.sim.coordinate_names)
        coordinates = np.stack([mirror(column) for column in np.eye(n)], axis=1)
        self.mirror = np.eye(2 * n + 4)
        self.mirror[:n, :n] = self.mirror[n : 2 * n, n : 2 * n] = coordinates
        self._mirror_torques = coordinates[3:, 3:]
        # Takes out the translation of feet and anchor.
        self.reduction = np.eye(2 * n + 4)
        self.reduction[0, 0], self.reduction[2 * n, 0] = 0.0, -1.0

    @property
    def state(self) -> Array:
        """Relative state of the simulator (2 n + 4,)."""
        x = self.reduction @ self.sim.state_vector()
        x[2 * self.n + 1 :] -= self.sim.time
        return x

    def back(self, steps: int) -> Array:
        """Return the mirror (s, s) that undoes an odd number of gait steps."""
        return self.mirror if steps % 2 else np.eye(len(self.mirror))

    def at(self, start: Start) -> Array:
        """Set the simulator to a start, and return its relative state."""
        self.sim.restore(start.snapshot)
        return self.state

    def torque(self, start: Start) -> Array | None:
        """Return the residual torque from the present time on (joints,) [N m]; None for zero."""
        if start.torques is None:
            return None
        cycle, place = divmod(self._action(start), len(start.torques))
        torque: Array = start.torques[place]
        odd = bool(cycle * start.steps % 2)
        if odd:
            torque = self._mirror_torques @ torque
        if (self.sim.support_leg == start.leg) == odd:
            # A held torque stays on its joint when the legs swap; their order and signs reverse.
            torque = np.concatenate([-torque[_LEGS][::-1], torque[_LEGS.stop :]])
        return torque

    def _action(self, start: Start) -> int:
        """Return the number of the present action, counted from the start."""
        assert start.torques is not None
        samples = self.sim.time / start.period - start.tick
        return math.floor((samples + _ROUNDING) * len(start.torques) / start.samples)

    def pieces(self, start: Start, until: float) -> Iterator[tuple[float, Array | None]]:
        """Yield ends and torques of the pieces with constant torques from the present time.

        The caller moves the simulator to each end before it asks for the next one.
        """
        if start.torques is None:
            yield until, None
            return
        length = start.samples // len(start.torques)
        while self.sim.time < until:
            end = (start.tick + (self._action(start) + 1) * length) * start.period
            yield min(end, until), self.torque(start)

    def advance(self, start: Start, until: float) -> bool:
        """Advance the simulator with the torques of a cycle; return whether it can continue."""
        return all(self.sim.advance(end, torque) for end, torque in self.pieces(start, until))

    def linearize(self, start: Start, until: float) -> Flow:
        """Differentiate the motion to a time, and advance the simulator.

        Raises
        ------
        ValueError
            If the motion ends before.
        """
        found = []
        for end, torque in self.pieces(start, until):
            found.append(self.sim.linearize(torque, until=end))
            self.sim.advance(end, torque)
        A, B = found[0].A, found[0].B
        for lin in found[1:]:
            A, B = lin.A @ A, lin.A @ B + lin.B
        return Flow(
            A,
            B,
            found[0].tangent_before,
            [event for lin in found for event in lin.events],
            [reason for lin in found for reason in lin.nonsmooth],
        )

    def end(self, start: Start) -> Array:
        """Return the relative state after a cycle, mirrored back; infinite after a fall."""
        self.sim.restore(start.snapshot)
        if not all(self.advance(start, until) for until in start.ends()):
            return np.full(len(self.mirror), np.inf)
        end: Array = self.back(start.steps) @ self.state
        return end

    def residual(self, start: Start) -> Array:
        """Return what a cycle changes (s,); infinite after a fall."""
        before = self.at(start)
        return self.end(start) - before

    def later(self, start: Start, samples: int) -> Start:
        """Return the start that many samples later on the motion without residual torques."""
        self.sim.restore(start.snapshot)
        self.sim.advance((start.tick + samples) * start.period)
        return replace(start, snapshot=self.sim.snapshot(), tick=start.tick + samples)

    def displaced(self, start: Start, dx: Array) -> Start:
        """Return the start with ``dx`` (s,) added and projected onto the constraints."""
        self.sim.restore(start.snapshot)
        self.sim.displace(dx)
        return replace(start, snapshot=self.sim.snapshot())

    def rebuilt(self, start: Start, period: float) -> Start:
        """Return the start at time 0 with another period of the samples.

        A reset takes the contact state from positions and velocities alone. In a state inside a
        guard this may be another one.
        """
        x = self.at(start)
        self.set(x, self.sim.support_leg, {SAMPLE_PERIOD: period})
        return replace(start, snapshot=self.sim.snapshot(), tick=0, period=period)

    def set(self, x: Array, leg: str, params: dict[str, float] | None = None) -> None:
        """Reset the simulator to a relative state ``x`` (s,) with its memory.

        Raises
        ------
        ValueError
            If it is no valid start.
        """
        self.sim.reset(x[: self.n], x[self.n : 2 * self.n], leg, params)
        memory = np.zeros_like(x)
        memory[2 * self.n :] = (x - self.state)[2 * self.n :]
        self.sim.displace(memory)

    def derivative(self, start: Start) -> Derivative:
        """Differentiate a cycle.

        Raises
        ------
        ValueError
            If the motion ends within the cycle.
        """
        self.sim.restore(start.snapshot)
        whole = np.eye(len(self.mirror))
        parts = []
        for until in start.ends():
            parts.append(self.linearize(start, until))
            whole = parts[-1].A @ whole
        A = self.back(start.steps) @ self.reduction @ whole
        left_out = unread(A, 2 * self.n)
        basis = self.basis(parts[0].tangent_before, left_out)
        return Derivative(basis.T @ A @ basis, basis, left_out, parts)

    def basis(self, tangent: Array, unread: Sequence[int]) -> Array:
        """Return an orthonormal basis of a tangent space (s, m) without translation and memory."""
        reduced = self.reduction @ tangent
        reduced[list(unread)] = 0.0
        left, size, _ = np.linalg.svd(reduced, full_matrices=False)
        basis: Array = left[:, size > _NULL]
        return basis


def unread(A: Array, first: int) -> list[int]:
    """Return the states from ``first`` on that a cycle neither reads nor writes."""
    others = A - np.diag(np.diag(A))
    found = (np.abs(others).max(axis=0) < _UNREAD) & (np.abs(np.diag(A) - 1.0) < _UNREAD)
    return [j for j in range(first, len(A)) if found[j]]


def units(strobe: Strobe) -> dict[str, Any]:
    """Return index sets of states that have one unit, by the name of the unit."""
    n = strobe.n
    return {
        "m": [0, 1, 2 * n],
        "rad": list(range(2, n)),
        "m/s": [n, n + 1],
        "rad/s": list(range(n + 2, 2 * n)),
        "s": [2 * n + 1, 2 * n + 2, 2 * n + 3],
    }
