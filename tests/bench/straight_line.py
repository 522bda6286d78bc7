"""Forward dynamics of the robot's tree as straight-line arithmetic.

Articulated-body algorithm (Featherstone 2008, section 7.3), with three reductions: moments are
about each body's own joint; those of a limb are in the axes of the body that carries it (of a leg
in the world's axes); inertia that a rotation about the joint does not change is assigned to the
parent.
CasADi removes products with zero and unused results, so a planar limb has planar costs.
"""

from __future__ import annotations

from dataclasses import dataclass
from importlib import import_module
from typing import Any

from skate_env._core import Simulator

from .tree import BEFORE, Array, Body, X, tree

# CasADi has no type annotations.
SX = Any
Function = Any
Rotation = tuple[int, SX, SX]
"""Rotation: axis, cosine and sine of the angle."""


@dataclass(frozen=True)
class StraightLine:
    """Accelerations as two functions; sines and cosines are computed between them."""

    angles: Function
    """Maps q to the angle of every joint."""
    accelerations: Function
    """Maps the sines and cosines of the angles, q' and tau to q''."""


def straight_line(
    simulator: Simulator, gravity: float, friction: float | None = None
) -> StraightLine:
    """Return q'' as a function of q, q' and tau, each with all coordinates.

    Parameters
    ----------
    simulator
        The robot; its supporting foot is in the air or rotates about its toe.
    gravity
        [m/s2]
    friction
        None in flight. On the ice the toe slides at constant height, and this is the ratio of the
        force along y to the normal force.
    """
    ca = _casadi()
    n = len(simulator.coordinate_names)
    q, v, tau = (ca.SX.sym(name, n) for name in ("q", "v", "tau"))
    sines, cosines = (ca.SX.sym(name, n - BEFORE) for name in ("sines", "cosines"))

    bodies = tree(simulator)
    angles = q[BEFORE:]
    motions: list[_Motion] = []
    for body in bodies:
        parent = None if body.parent < 0 else motions[body.parent]
        if body.in_limb and parent is not None and bodies[body.parent].in_limb:
            angles[body.joint] += angles[bodies[body.parent].joint]
        motions.append(_motion(body, parent, v, (cosines, sines)))
    moving = list(zip(bodies, motions, strict=True))

    wrenches = [_inertial(body, motion) for body, motion in moving]
    gains: list[tuple[SX, SX, SX]] = [(0, 0, 0)] * len(bodies)
    reciprocals: list[tuple[SX, SX]] = []
    for i, (body, motion) in reversed(list(enumerate(moving))):
        if body.axis is not None:
            c = BEFORE + body.joint
            torque = tau[c] - body.damping * v[c]
            reciprocal = ca.SX.sym("reciprocal")
            reciprocals.append((reciprocal, wrenches[i].A[body.axis, body.axis]))
            wrenches[i], gains[i] = _eliminate(wrenches[i], body.axis, torque, reciprocal)
        if body.parent >= 0:
            moved = wrenches[i].shifted(motion.gyration, ca.SX(3, 1))
            for rotation in motion.turns:
                moved = moved.turned(rotation)
            moved = moved.shifted(ca.SX(3, 1), motion.centripetal).moved(motion.offset)
            wrenches[body.parent] += moved

    result = ca.SX(n, 1)
    a = _pivot(wrenches[0], gravity, friction, tau)
    result[0], result[1] = a[1], a[2] - gravity
    found: list[tuple[SX, SX]] = []
    for (body, motion), (free, by_alpha, by_a) in zip(moving, gains, strict=True):
        alpha = ca.SX(3, 1)
        if body.parent >= 0:
            alpha, a = found[body.parent]
            a = a + ca.cross(alpha, motion.offset) + motion.centripetal
            for axis, cosine, sine in reversed(motion.turns):
                back = axis, cosine, -sine
                alpha, a = _turn(back, alpha), _turn(back, a)
        if body.axis is not None:
            carried = alpha[body.axis]
            alpha = alpha + motion.gyration
            alpha[body.axis] = free - ca.dot(by_alpha, alpha) - ca.dot(by_a, a)
            result[BEFORE + body.joint] = alpha[body.axis] - carried
        found.append((alpha, a))
    given, result = [sines, cosines, v, tau], _with_reciprocals(result, reciprocals)
    return StraightLine(
        ca.Function("angles", [q], [angles]), ca.Function("accelerations", given, [result])
    )


def _with_reciprocals(result: SX, reciprocals: list[tuple[SX, SX]]) -> SX:
    """Substitute reciprocals, each of which may contain those before it.

    Otherwise CasADi generates a division for every use of a reciprocal.
    """
    ca = _casadi()
    shared = ca.cse(ca.vertcat(*(of for _, of in reciprocals), result))
    count = len(reciprocals)
    denominators, result = ca.vertsplit(shared[:count]), shared[count:]
    ca.GlobalOptions.setSimplificationOnTheFly(False)
    try:
        inverses = [1.0 / denominator for denominator in denominators]
        [result] = ca.substitute_inplace([name for name, _ in reciprocals], inverses, [result])[1]
    finally:
        ca.GlobalOptions.setSimplificationOnTheFly(True)
    return result


@dataclass
class _Motion:
    """Motion of a body, in the axes of its equations."""

    turn: Rotation | None
    """Rotation from the body's own axes to these; None if they are the same."""
    omega: SX
    turns: list[Rotation]
    """Rotations from these axes to those of the parent's equations."""
    offset: SX
    """Position of the joint relative to the parent's, in the parent's axes."""
    centripetal: SX
    """Centripetal acceleration of the joint, in the parent's axes."""
    gyration: SX
    """Angular acceleration due to the parent's rotation."""

    def turned(self, x: Array) -> SX:
        """Rotate a vector or matrix of the body into these axes."""
        ca = _casadi()
        constant = ca.SX(ca.sparsify(ca.DM(x)))
        if self.turn is None:
            return constant
        return (_turn if x.ndim == 1 else _turn_matrix)(self.turn, constant)


def _motion(body: Body, parent: _Motion | None, v: SX, angles: tuple[SX, SX]) -> _Motion:
    """`angles` are relative to the parent, in a limb to the limb's carrier."""
    ca = _casadi()
    cosines, sines = angles
    omega = offset = centripetal = gyration = ca.SX(3, 1)
    if parent is not None:
        omega, offset = parent.omega, parent.turned(body.offset)
        centripetal = ca.cross(omega, ca.cross(omega, offset))
    turn, turns = None, []
    if body.in_limb:
        turn = X, cosines[body.joint], sines[body.joint]
    elif body.axis is not None:
        turns = [(body.axis, cosines[body.joint], sines[body.joint])]
        if parent is not None and parent.turn is not None:
            turns.append(parent.turn)
        for axis, cosine, sine in reversed(turns):
            omega = _turn((axis, cosine, -sine), omega)
    if body.axis is not None:
        relative = ca.SX(3, 1)
        relative[body.axis] = v[BEFORE + body.joint]
        gyration = ca.cross(omega, relative)
        omega = omega + relative
    return _Motion(turn, omega, turns, offset, centripetal, gyration)


@dataclass
class _Wrench:
    """Force f and moment n about a joint that accelerate a body and its descendants.

    n = A alpha + B a + n0 and f = B' alpha + C a + f0 with the angular acceleration alpha and the
    joint's acceleration a.
    """

    A: SX
    B: SX
    C: SX
    n0: SX
    f0: SX

    def shifted(self, alpha: SX, a: SX) -> _Wrench:
        """Add accelerations to the reference of alpha and a."""
        n0 = self.n0 + self.A @ alpha + self.B @ a
        f0 = self.f0 + self.B.T @ alpha + self.C @ a
        return _Wrench(self.A, self.B, self.C, n0, f0)

    def turned(self, rotation: Rotation) -> _Wrench:
        """Express the wrench in axes that a rotation maps to the present ones."""
        A, B, C = (_turn_matrix(rotation, each) for each in (self.A, self.B, self.C))
        return _Wrench(A, B, C, _turn(rotation, self.n0), _turn(rotation, self.f0))

    def moved(self, r: SX) -> _Wrench:
        """Move the reference point by -r."""
        cross = _casadi().skew(r)
        B = self.B + cross @ self.C
        A = _symmetric(self.A - self.B @ cross + cross @ B.T)
        return _Wrench(A, B, self.C, self.n0 + cross @ self.f0, self.f0)

    def __add__(self, other: _Wrench) -> _Wrench:
        mine, others = vars(self), vars(other)
        return _Wrench(**{name: mine[name] + others[name] for name in mine})


def _inertial(body: Body, motion: _Motion) -> _Wrench:
    """Wrench that accelerates a body without its descendants."""
    ca = _casadi()
    moment, inertia, omega = motion.turned(body.moment), motion.turned(body.inertia), motion.omega
    mass = ca.SX(3, 3)
    if body.mass != 0.0:
        mass = body.mass * ca.SX.eye(3)
    return _Wrench(
        inertia,
        ca.skew(moment),
        mass,
        ca.cross(omega, inertia @ omega),
        ca.cross(omega, ca.cross(omega, moment)),
    )


def _eliminate(
    wrench: _Wrench, axis: int, torque: SX, inverse: SX
) -> tuple[_Wrench, tuple[SX, SX, SX]]:
    """Eliminate a joint under a torque; `inverse` is the reciprocal of its inertia.

    Returns the remaining wrench, and the angular acceleration about the axis: its constant part,
    and its negative derivatives by the other components of alpha and by a.
    """
    a_row, b_row = wrench.A[axis, :], wrench.B[axis, :]
    by_alpha, by_a = inverse * a_row.T, inverse * b_row.T
    by_alpha[axis] = 0.0
    free = inverse * (torque - wrench.n0[axis])
    A = _symmetric(wrench.A - by_alpha @ a_row)
    A[axis, :] = A[:, axis] = 0.0
    B = wrench.B - by_alpha @ b_row
    B[axis, :] = 0.0
    C = _symmetric(wrench.C - by_a @ b_row)
    n0, f0 = wrench.n0 + free * a_row.T, wrench.f0 + free * b_row.T
    n0[axis] = torque
    return _Wrench(A, B, C, n0, f0), (free, by_alpha, by_a)


def _pivot(wrench: _Wrench, gravity: float, friction: float | None, tau: SX) -> SX:
    """Return the root's acceleration in a frame in free fall, which has no gravity."""
    a, C = _casadi().SX(3, 1), wrench.C
    y, z = tau[0] - wrench.f0[1], tau[1] - wrench.f0[2]
    if friction is None:
        inverse = 1.0 / (C[1, 1] * C[2, 2] - C[1, 2] * C[1, 2])
        a[1] = inverse * (C[2, 2] * y - C[1, 2] * z)
        a[2] = inverse * (C[1, 1] * z - C[1, 2] * y)
    else:
        a[2] = gravity
        # Normal force: C_zy a_y + C_zz g - z; force along y: `friction` times that.
        rest = y - C[1, 2] * gravity + friction * (C[2, 2] * gravity - z)
        a[1] = rest / (C[1, 1] - friction * C[1, 2])
    return a


def _turn(rotation: Rotation, x: SX) -> SX:
    """Rotate a vector."""
    axis, cosine, sine = rotation
    j, k = (axis + 1) % 3, (axis + 2) % 3
    turned = _casadi().SX(x)
    turned[j], turned[k] = cosine * x[j] - sine * x[k], sine * x[j] + cosine * x[k]
    return turned


def _turn_matrix(rotation: Rotation, x: SX) -> SX:
    """Rotate a matrix: R x R'."""
    axis, cosine, sine = rotation
    j, k = (axis + 1) % 3, (axis + 2) % 3
    turned = _casadi().SX(x)
    turned[axis, :], turned[:, axis] = _turn(rotation, x[axis, :].T).T, _turn(rotation, x[:, axis])
    half = sine * (x[j, j] - x[k, k]) + cosine * (x[j, k] + x[k, j])
    turned[j, j], turned[k, k] = x[j, j] - sine * half, x[k, k] + sine * half
    turned[j, k], turned[k, j] = cosine * half - x[k, j], cosine * half - x[j, k]
    return turned


def _symmetric(x: SX) -> SX:
    """Copy the upper triangle to the lower one, which saves half the arithmetic."""
    ca = _casadi()
    return ca.triu2symm(ca.triu(x))


def _casadi() -> Any:
    # Optional dependency.
    return import_module("casadi")
