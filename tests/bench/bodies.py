"""The same body in the same state in MuJoCo and in Pinocchio."""

from collections.abc import Sequence
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any

import numpy as np

from skate_env._core import Simulator
from skate_env.scenes import replace, to_mjcf
from skate_env.studies.motions.cases import Case
from skate_env.studies.motions.mujoco_model import Setting, load
from skate_env.studies.timing import Array

from .peers import Unavailable, package
from .states import touching

AGREEMENT = 1e-10
"""Tolerance of mass matrix and bias forces, relative to their largest entry."""
# Approximate static penetration of MuJoCo's soft contacts [m].
_PENETRATION = 1e-3


class MujocoBody:
    """MuJoCo's model and data, one step after a simulator's state, under the same torques.

    MuJoCo's solver then starts from the accelerations of the last step, as in any simulation.

    Raises
    ------
    Unavailable
        If MuJoCo is not installed.
    RuntimeError
        If mass matrix or bias forces differ.
    """

    def __init__(self, sim: Simulator, setting: Setting) -> None:
        self.mj = mj = package("mujoco")
        scene = replace(sim.scene, {"start.support_leg": sim.support_leg})
        self.model = load(Case("bench", "", scene, 0.0, smooth=setting.contact is None), setting)
        self.data = mj.MjData(self.model)
        self.data.qpos[:], self.data.qvel[:] = sim.q, sim.v
        self.data.qfrc_applied[:] = sim.torque
        mj.mj_forward(self.model, self.data)
        check(sim, "MuJoCo", self._mass_matrix(), np.array(self.data.qfrc_bias))
        if setting.contact is not None and touching(sim):
            self.data.qpos[1] -= _PENETRATION
        mj.mj_step(self.model, self.data)
        mj.mj_forward(self.model, self.data)

    @property
    def contacts(self) -> int:
        """Number of sole ends in contact."""
        return int(self.data.ncon)

    def solve(self) -> None:
        """Use the present solution as the solver's initial guess."""
        self.data.qacc_warmstart[:] = self.data.qacc

    def _mass_matrix(self) -> Array:
        made = np.empty((self.model.nv, self.model.nv))
        # The arguments of mj_fullM depend on the version.
        for row, unit in zip(made, np.eye(self.model.nv), strict=True):
            self.mj.mj_mulM(self.model, self.data, row, unit)
        return made

    def saved(self) -> Array:
        """Return the state that determines the next step."""
        spec = self.mj.mjtState.mjSTATE_INTEGRATION
        state = np.empty(self.mj.mj_stateSize(self.model, spec))
        self.mj.mj_getState(self.model, self.data, state, spec)
        return state

    def restore(self, state: Array) -> None:
        """Restore a state that `saved` returned."""
        self.mj.mj_setState(self.model, self.data, state, self.mj.mjtState.mjSTATE_INTEGRATION)

    def is_stable(self, steps: int, fastest: float) -> bool:
        """Whether all speeds of a free fall without torques stay below `fastest` [rad/s, m/s]."""
        before = self.saved()
        self.data.qfrc_applied[:] = 0.0
        self.mj.mj_step(self.model, self.data, nstep=steps)
        sound = bool(
            (np.abs(self.data.qvel) < fastest).all() and not self.data.warning.number.any()
        )
        self.mj.mj_resetData(self.model, self.data)
        self.restore(before)
        return sound


def with_equal_contacts(pairs: Sequence[tuple[Simulator, MujocoBody]]) -> list[MujocoBody]:
    """Return the bodies with as many contacts as the simulator they are paired with.

    Raises
    ------
    Unavailable
        If there is none.
    """
    found = [body for sim, body in pairs if body.contacts == touching(sim)]
    if not found:
        raise Unavailable("no state in which MuJoCo has as many contacts")
    return found


class PinocchioBody:
    """Pinocchio's model and data in a simulator's state; raises as `MujocoBody`."""

    def __init__(self, sim: Simulator) -> None:
        self.pin = pin = package("pinocchio", "pin")
        scene = replace(sim.scene, {"start.support_leg": sim.support_leg})
        with TemporaryDirectory() as folder:
            path = Path(folder) / "robot.xml"
            path.write_text(to_mjcf(scene), encoding="utf-8")
            self.model = pin.buildModelFromMJCF(str(path))
        self.data = self.model.createData()
        self.q, self.v = sim.q, sim.v
        self.torque = sim.torque
        self.torque[3:] -= [body["damping"] for body in sim.bodies()][1:] * self.v[3:]
        upper = np.triu(pin.crba(self.model, self.data, self.q))
        bias = pin.rnea(self.model, self.data, self.q, self.v, np.zeros_like(self.v))
        check(sim, "Pinocchio", upper + np.triu(upper, 1).T, bias)


def check(sim: Simulator, tool: str, inertia: Any, bias: Any) -> None:
    q, v = sim.q, sim.v
    for ours, theirs in ((sim.mass_matrix(q), inertia), (sim.bias_forces(q, v), bias)):
        off = float(np.abs(ours - theirs).max() / np.abs(ours).max())
        if off > AGREEMENT:
            raise RuntimeError(
                f"{tool} has another body: relative error {off:.1e}, at most {AGREEMENT:.0e}"
            )
