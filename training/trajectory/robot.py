"""The robot in CasADi: inverse dynamics, the ends of its soles and its head.

Bodies, coordinates and units are those of `Simulator.bodies`.
"""

from collections.abc import Sequence
from typing import Any

import casadi as ca
import numpy as np
from numpy.typing import NDArray

from skate_env import _core

SX = Any
GRAVITY = 9.81
# Bodies of `Simulator.bodies` without locked joints.
_ANKLE, _FREE_FOOT, _HEAD = 1, 6, 16


class Robot:
    """CasADi functions of coordinates q, velocities v and accelerations a (19,).

    Attributes
    ----------
    inverse_dynamics
        (q, v, a) to generalised forces without joint damping and contact (19,), by the recursive
        Newton-Euler algorithm (Featherstone 2008, section 5.3).
    ends
        q to y and z of supporting heel and toe, free heel and toe (4, 2) [m].
    head
        q to the top of the head (3,) [m].
    ankle
        q to the supporting ankle (3,) [m].
    damping
        Of each coordinate (19,).
    """

    def __init__(self, sim: _core.Simulator, foot: tuple[float, float, float], head: float) -> None:
        """Build the functions from a simulator.

        Parameters
        ----------
        sim
            Of a scene without locked joints.
        foot
            Ankle to toe and to heel along the sole, and above it [m].
        head
            Length of the head [m].
        """
        self.bodies = sim.bodies()
        self.n = n = len(sim.q)
        q, v, a = (ca.SX.sym(name, n) for name in "qva")
        self.inverse_dynamics = ca.Function("rnea", [q, v, a], [self._rnea(q, v, a)])
        frames = self._frames(q)
        ends = _ends(frames, foot)
        self.ends = ca.Function("ends", [q], [ends])
        rotation, origin = frames[_HEAD]
        top = origin + rotation @ ca.SX([0.0, 0.0, head])
        self.head = ca.Function("head", [q], [top])
        self.ankle = ca.Function("ankle", [q], [frames[_ANKLE][1]])
        # Rows y0, z0, y1, z1, ... of the ends.
        jacobian = ca.jacobian(ca.vec(ends.T), q)
        self.jacobian = ca.Function("jacobian", [q], [jacobian])
        rate = jacobian @ v
        self.end_velocities = ca.Function("end_v", [q, v], [_pairs(rate)])
        acceleration = ca.jtimes(rate, q, v) + jacobian @ a
        self.end_accelerations = ca.Function("end_a", [q, v, a], [_pairs(acceleration)])
        mass = ca.jacobian(self._rnea(q, ca.SX.zeros(n), a), a)
        self.mass_matrix = ca.Function("M", [q], [mass])
        self.damping = np.array([0.0, 0.0, *(body["damping"] for body in self.bodies)])
        self.damping[2] = 0.0

    def _frames(self, q: SX) -> list[tuple[SX, SX]]:
        """Return rotation matrix and origin of each body."""
        frames: list[tuple[SX, SX]] = []
        for i, body in enumerate(self.bodies):
            offset = ca.SX(np.array(body["offset"]))
            if i == 0:
                frames.append((_rotation("x", q[2]), ca.vertcat(offset[0], q[0], q[1])))
                continue
            rotation, origin = frames[body["parent"]]
            frames.append(
                (rotation @ _rotation(body["axis"], q[i + 2]), origin + rotation @ offset)
            )
        return frames

    def _rnea(self, q: SX, v: SX, a: SX) -> SX:
        frames = self._frames(q)
        axes, rates, angular, linear = self._accelerations(frames, v, a)
        n = len(self.bodies)
        force, moment = [ca.SX.zeros(3)] * n, [ca.SX.zeros(3)] * n
        tau = [ca.SX(0.0)] * (n + 2)
        for i in reversed(range(n)):
            body, (rotation, origin) = self.bodies[i], frames[i]
            com = rotation @ ca.SX(np.array(body["com"]))
            at_com = linear[i] + ca.cross(angular[i], com)
            at_com += ca.cross(rates[i], ca.cross(rates[i], com))
            inertia = rotation @ ca.SX(np.array(body["inertia"])) @ rotation.T
            own = body["mass"] * at_com
            turning = inertia @ angular[i] + ca.cross(rates[i], inertia @ rates[i])
            force[i] = force[i] + own
            moment[i] = moment[i] + turning + ca.cross(com, own)
            tau[i + 2] = ca.dot(axes[i], moment[i])
            if i == 0:
                tau[0], tau[1] = force[i][1], force[i][2]
                continue
            p = body["parent"]
            force[p] = force[p] + force[i]
            moment[p] = moment[p] + moment[i] + ca.cross(origin - frames[p][1], force[i])
        return ca.vertcat(*tau)

    def _accelerations(
        self, frames: Sequence[tuple[SX, SX]], v: SX, a: SX
    ) -> tuple[list[SX], list[SX], list[SX], list[SX]]:
        """Return joint axes, angular velocities, angular and linear accelerations in the world."""
        axes: list[SX] = []
        rates: list[SX] = []
        angular: list[SX] = []
        linear: list[SX] = []
        for i, body in enumerate(self.bodies):
            origin = frames[i][1]
            if i == 0:
                axis = ca.SX([1.0, 0.0, 0.0])
                rates.append(axis * v[2])
                angular.append(axis * a[2])
                linear.append(ca.vertcat(0.0, a[0], a[1] + GRAVITY))
            else:
                p = body["parent"]
                axis = frames[p][0][:, "xyz".index(body["axis"])]
                r, w = origin - frames[p][1], rates[p]
                rates.append(w + axis * v[i + 2])
                angular.append(angular[p] + axis * a[i + 2] + ca.cross(w, axis) * v[i + 2])
                linear.append(linear[p] + ca.cross(angular[p], r) + ca.cross(w, ca.cross(w, r)))
            axes.append(axis)
        return axes, rates, angular, linear


def _rotation(axis: str, angle: SX) -> SX:
    c, s = ca.cos(angle), ca.sin(angle)
    if axis == "x":
        return ca.vertcat(ca.horzcat(1, 0, 0), ca.horzcat(0, c, -s), ca.horzcat(0, s, c))
    if axis == "y":
        return ca.vertcat(ca.horzcat(c, 0, s), ca.horzcat(0, 1, 0), ca.horzcat(-s, 0, c))
    return ca.vertcat(ca.horzcat(c, -s, 0), ca.horzcat(s, c, 0), ca.horzcat(0, 0, 1))


def _ends(frames: Sequence[tuple[SX, SX]], foot: tuple[float, float, float]) -> SX:
    toe, heel, height = foot
    rotation, support_toe = frames[0]
    support_heel = support_toe + rotation @ ca.SX([0.0, -(toe + heel), 0.0])
    rotation, ankle = frames[_FREE_FOOT]
    free_toe = ankle + rotation @ ca.SX([0.0, toe, -height])
    free_heel = ankle + rotation @ ca.SX([0.0, -heel, -height])
    return ca.vertcat(*(end[1:].T for end in (support_heel, support_toe, free_heel, free_toe)))


def _pairs(stacked: SX) -> SX:
    """Turn y0, z0, y1, ... into rows (y, z)."""
    return ca.reshape(stacked, 2, 4).T


def numbers(values: Any) -> NDArray[np.float64]:
    """Convert a CasADi matrix to an array without dimensions of length 1."""
    return np.squeeze(np.array(values, dtype=np.float64))
