"""The equations of motion in the contact phases of a step in the paper's order, in CasADi.

Contact forces are lam = (N heel, N toe, T) of the supporting foot and the same of the free foot
[N]: normal forces at the ends of the soles and the force along y.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import casadi as ca

from .robot import Robot

# Friction of the preset `push_only`.
MU_FORWARD, MU_BACKWARD = 0.2, 0.9
# Places in lam of the normal forces, in the order of `Robot.ends`.
NORMAL = (0, 1, 3, 4)
# Scale of forces and torques in the equations.
_SCALE = 10.0


@dataclass(frozen=True)
class Phase:
    """A contact phase.

    Attributes
    ----------
    state
        Row of Table 2.
    ends
        Which of supporting heel and toe, free heel and toe are on the ice.
    law
        Feedforward: "swing" (states 1 to 4), "landing" (5 to 12), "push" (14, 16, 18, 20) or none.
    """

    state: int
    ends: tuple[bool, bool, bool, bool]
    law: str | None

    @property
    def fixed(self) -> bool:
        """Whether the supporting toe is at rest; otherwise it slides forward."""
        return self.state == 14


PHASES = (
    Phase(3, (True, True, False, False), "swing"),
    Phase(7, (True, True, True, False), "landing"),
    Phase(15, (True, True, True, True), None),
    Phase(16, (False, True, True, True), "push"),
    Phase(14, (False, True, True, True), "push"),
)


def feedforward(law: str | None, time: Any) -> Any:
    """Return the printed torques tau2 to tau6 by coordinate (19,), Eqs. 17 to 20 [N m].

    `time` is that since the law's beginning [s]. Without tau1, tau7 and tau8.
    """
    torque, c = ca.SX.zeros(19), ca.cos(ca.pi * time)
    if law == "swing":
        torque[6], torque[7] = 50.0 * c, 20.0
    elif law == "landing":
        torque[3], torque[4], torque[6] = -205.0 * c, -50.0 * c, 100.0 * c
    elif law == "push":
        torque[3], torque[6] = -75.0 * c, 30.0
    return torque


class Dynamics:
    """CasADi functions of the phases.

    Arguments are q, v, a (19,), lam (6,), the residual torques u (16,), the time since the law's
    beginning [s] and the parameters p of `PARAMETERS`.
    """

    def __init__(self, robot: Robot, scale: float) -> None:
        """Build the functions; `scale` multiplies the printed torques."""
        self.robot = robot
        self._scale = scale
        self._symbols = [
            ca.SX.sym(name, size)
            for name, size in (("q", 19), ("v", 19), ("a", 19), ("lam", 6), ("u", 16), ("t", 1))
        ]
        self._p = ca.SX.sym("p", len(PARAMETERS))
        q, v, a, lam, _, _ = self._symbols
        self._contact = _contact_forces(robot.jacobian(q), lam)
        self._lifting = self._lift(q)
        jump = robot.mass_matrix(q) @ (a - v) - self._contact
        # q, velocities before and after, impulses.
        self.impact = ca.Function("impact", [q, v, a, lam], [jump])
        self._made: dict[tuple[int, str | None], Any] = {}

    def equations(self, phase: Phase, law: str | None) -> Any:
        """Return the function of equations that are zero in a phase, and total torques (16,)."""
        key = (phase.state, law)
        if key not in self._made:
            q, v, a, lam, u, time = self._symbols
            residual = ca.vertcat(0, 0, 0, u)
            total = self._lifting + self._scale * feedforward(law, time) + residual
            robot = self.robot
            motion = robot.inverse_dynamics(q, v, a) + robot.damping * v - total - self._contact
            at_ends = robot.end_accelerations(q, v, a)
            held = [at_ends[i, 1] for i in range(4) if phase.ends[i]]
            sliding = [lam[5] + MU_FORWARD * (lam[3] + lam[4])]
            if phase.fixed:
                held.append(at_ends[1, 0])
            else:
                sliding.append(lam[2] + MU_FORWARD * (lam[0] + lam[1]))
            zero = ca.vertcat(motion / _SCALE, *held, *(force / _SCALE for force in sliding))
            self._made[key] = ca.Function(
                f"phase_{phase.state}_{law}", [*self._symbols, self._p], [zero, total[3:]]
            )
        return self._made[key]

    def _lift(self, q: Any) -> Any:
        """Return the forces of the visual lifting in the joints, Eqs. 14 and 15."""
        p, head, ankle = self._p, self.robot.head(q), self.robot.ankle(q)
        force = ca.vertcat(
            -p[0] * head[0],
            p[0] * (ankle[1] + p[2] - head[1]),
            p[1] * (p[3] - head[2]),
        )
        torque = ca.jacobian(head, q).T @ force
        # It acts in the joints only.
        torque[:3] = 0.0
        return torque


# Gains of the lifting along x and y, and along z [N/m]; its target ahead of the supporting ankle
# and above the ice [m].
PARAMETERS = ("K_y", "K_z", "ahead", "height")


def _contact_forces(jacobian: Any, lam: Any) -> Any:
    normal = jacobian[[1, 3, 5, 7], :].T @ ca.vertcat(*(lam[i] for i in NORMAL))
    # The supporting toe and the free heel are on the ice in all phases with a force of the foot.
    return normal + jacobian[2, :].T * lam[2] + jacobian[4, :].T * lam[5]


def swapped(first: Sequence[Any], values: Any) -> Any:
    """Return coordinates or velocities (19,) after the swap of the legs, mirrored.

    `first` replaces y0, z0 and q1. The joints of the legs change their order and direction, yaw and
    roll their signs, the arms their sides.
    """
    legs = [-values[8 - i] for i in range(6)]
    arms = [values[i] for i in (15, 16, 17, 12, 13, 14)]
    return ca.vertcat(*first, *legs, -values[9], values[10], -values[11], *arms, values[18])
