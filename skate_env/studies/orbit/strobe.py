"""The stroboscopic map of a gait: the state after a whole number of the controller's samples.

The samples are at multiples of their period, so that a motion is not autonomous: it is periodic if
it repeats after a whole number of samples. The map takes the state at a sample to that after
``samples`` periods. In the engine's coordinates the legs are numbered from the supporting foot, so
that one gait step is half a cycle of the robot; after an odd number of steps the trunk and the arms
are mirrored.

States are relative: the supporting foot is at y = 0, the anchor counts from it, and the times t_0,
t_1, t_2 count from the present time.
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ..._core import Linearization, Scene, Simulator
from ...mirror import Mirror

Array = NDArray[np.float64]

SAMPLE_PERIOD = "control.sample_period"
# Singular values of directions that the reduction maps to zero.
_NULL = 1e-8
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
    """

    snapshot: bytes
    tick: int
    period: float
    steps: int
    samples: int

    @property
    def duration(self) -> float:
        """Of a cycle [s]."""
        return self.samples * self.period

    def ends(self) -> list[float]:
        """Return the times at which the parts of a cycle end, one part for each gait step [s]."""
        ticks = [self.tick + self.samples * (i + 1) // self.steps for i in range(self.steps)]
        return [tick * self.period for tick in ticks]


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
    parts: Sequence[Linearization]

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

    def end(self, start: Start) -> Array:
        """Return the relative state after a cycle, mirrored back; infinite after a fall."""
        self.sim.restore(start.snapshot)
        if not all(self.sim.advance(until) for until in start.ends()):
            return np.full(len(self.mirror), np.inf)
        end: Array = self.back(start.steps) @ self.state
        return end

    def residual(self, start: Start) -> Array:
        """Return what a cycle changes (s,); infinite after a fall."""
        before = self.at(start)
        return self.end(start) - before

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
        params = {SAMPLE_PERIOD: period}
        self.sim.reset(x[: self.n], x[self.n : 2 * self.n], self.sim.support_leg, params)
        memory = np.zeros_like(x)
        memory[2 * self.n :] = (x - self.state)[2 * self.n :]
        self.sim.displace(memory)
        return replace(start, snapshot=self.sim.snapshot(), tick=0, period=period)

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
            lin = self.sim.linearize(until=until)
            parts.append(lin)
            whole = lin.A @ whole
            self.sim.advance(until)
        A = self.back(start.steps) @ self.reduction @ whole
        unread = [j for j in range(2 * self.n, len(A)) if _is_unread(A, j)]
        basis = self.basis(parts[0].tangent_before, unread)
        return Derivative(basis.T @ A @ basis, basis, unread, parts)

    def basis(self, tangent: Array, unread: Sequence[int]) -> Array:
        """Return an orthonormal basis of a tangent space (s, m) without translation and memory."""
        reduced = self.reduction @ tangent
        reduced[list(unread)] = 0.0
        left, size, _ = np.linalg.svd(reduced, full_matrices=False)
        basis: Array = left[:, size > _NULL]
        return basis


def _is_unread(A: Array, j: int) -> bool:
    others = np.delete(A[:, j], j)
    return bool(np.abs(others).max() < _UNREAD and abs(A[j, j] - 1.0) < _UNREAD)


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
