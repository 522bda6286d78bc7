"""One step: durations, motion, forces and torques of its phases at the points of collocation."""

from dataclasses import dataclass
from pathlib import Path

import casadi as ca
import numpy as np
from numpy.typing import NDArray

from skate_env.common import npz, opened

from .dynamics import PHASES

Array = NDArray[np.float64]

DEGREE = 3
# Points of an interval of length 1, Radau; the last is 1.
POINTS = np.array(ca.collocation_points(DEGREE, "radau"))
_FIELDS = ("durations", "parameters", "start", "foot")
_SERIES = ("states", "forces", "torques")


@dataclass(frozen=True)
class Solution:
    """A step.

    Attributes
    ----------
    durations
        Of the phases (5,) [s].
    parameters
        Of the lifting, see `dynamics.PARAMETERS` (4,).
    start
        q and v at the beginning (38,).
    foot
        Ankle to toe and to heel, and its height [m].
    scale
        Of the feedforward.
    states
        For each phase q and v at the points (38, 3 n), n intervals.
    forces
        For each phase lam (6, 3 n) [N].
    torques
        For each phase residual torques at the ends of the intervals (16, n + 1) [N m]; linear
        between them.
    """

    durations: Array
    parameters: Array
    start: Array
    foot: tuple[float, float, float]
    scale: float
    states: list[Array]
    forces: list[Array]
    torques: list[Array]

    @property
    def cuts(self) -> Array:
        """Times at which the phases begin, and the end (6,) [s]."""
        return np.concatenate([[0.0], np.cumsum(self.durations)])

    def places(self, phase: int) -> Array:
        """Return the points of a phase, as parts of its duration (3 n,)."""
        n = self.states[phase].shape[1] // DEGREE
        return np.concatenate([(i + POINTS) / n for i in range(n)])

    def first(self, phase: int) -> Array:
        """Return the state at the beginning of a phase; after an impact it is extrapolated."""
        if phase == 0:
            return self.start
        if PHASES[phase].law == "push":
            return self.states[phase - 1][:, -1]
        extrapolate = _lagrange(POINTS, 0.0)
        return np.asarray(self.states[phase][:, :DEGREE] @ extrapolate)

    def state(self, phase: int, place: float) -> Array:
        """Return the state at a part of a phase's duration (38,), by the polynomials."""
        states = self.states[phase]
        n = states.shape[1] // DEGREE
        interval = min(int(place * n), n - 1)
        begin = DEGREE * interval
        first = states[:, begin - 1] if interval else self.first(phase)
        nodes = np.column_stack([first, states[:, begin : begin + DEGREE]])
        weights = _lagrange(np.concatenate([[0.0], POINTS]), place * n - interval)
        return np.asarray(nodes @ weights)

    def force(self, phase: int, place: float) -> Array:
        """Return forces at a part of a phase's duration (6,)."""
        return _interpolated(place, self.places(phase), self.forces[phase])

    def torque(self, phase: int, place: float) -> Array:
        """Return residual torques at a part of a phase's duration (16,)."""
        rows = self.torques[phase]
        return _interpolated(place, np.linspace(0.0, 1.0, rows.shape[1]), rows)

    def save(self, path: Path) -> None:
        """Write everything to an ``.npz`` file."""
        series = {
            f"{name}_{i}": each for name in _SERIES for i, each in enumerate(getattr(self, name))
        }
        fields = {name: getattr(self, name) for name in _FIELDS}
        npz.write(path, {"scale": self.scale, **fields, **series})


def load(path: Path) -> Solution:
    """Read a file of `Solution.save`."""
    with opened(path) as archive, np.load(archive, allow_pickle=False) as file:
        series = {name: [file[f"{name}_{i}"] for i in range(len(PHASES))] for name in _SERIES}
        toe, heel, height = file["foot"].tolist()
        return Solution(
            durations=file["durations"],
            parameters=file["parameters"],
            start=file["start"],
            foot=(toe, heel, height),
            scale=float(file["scale"]),
            **series,
        )


def _lagrange(nodes: Array, at: float) -> Array:
    """Weights of the values at the nodes in the polynomial through them."""
    others = [np.delete(nodes, i) for i in range(len(nodes))]
    return np.array([np.prod((at - m) / (x - m)) for x, m in zip(nodes, others, strict=True)])


def _interpolated(place: float, at: Array, rows: Array) -> Array:
    return np.array([np.interp(place, at, row) for row in rows])
