"""The same body, in the same state, in MuJoCo and in Pinocchio."""

from collections.abc import Sequence
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any

import numpy as np

from ..._core import Simulator
from ...mjcf import to_mjcf
from ...scenes import replace
from ..accuracy.cases import Case
from ..accuracy.mujoco_model import Setting, load
from ..timing import Array
from .peers import Missing, package
from .states import touching

AGREEMENT = 1e-10
"""Mass matrix and bias agree to this, relative to their largest entry."""
# How far MuJoCo's soles sink into the ice before it carries them, about [m].
_SUNK = 1e-3


class MujocoBody:
    """MuJoCo's model and data under way, a step after a simulator's state, under its torques.

    So its solver begins, as in any simulation, with the last step's accelerations.

    Raises
    ------
    Missing
        If MuJoCo is not installed.
    RuntimeError
        If it is another body.
    """

    def __init__(self, sim: Simulator, setting: Setting) -> None:
        self.mj = mj = package("mujoco")
        scene = replace(sim.scene, {"start.support_leg": sim.support_leg})
        self.model = load(Case("bench", "", scene, 0.0, smooth=setting.contact is None), setting)
        self.data = mj.MjData(self.model)
        self.data.qpos[:], self.data.qvel[:] = sim.q, sim.v
        self.data.qfrc_applied[:] = sim.torque
        mj.mj_forward(self.model, self.data)
        _check(sim, "MuJoCo", self._mass_matrix(), np.array(self.data.qfrc_bias))
        if setting.contact is not None and touching(sim):
            self.data.qpos[1] -= _SUNK
        mj.mj_step(self.model, self.data)
        mj.mj_forward(self.model, self.data)

    @property
    def contacts(self) -> int:
        """Ends of the soles that touch."""
        return int(self.data.ncon)

    def solve(self) -> None:
        """Let the solver begin with its solution from now on."""
        self.data.qacc_warmstart[:] = self.data.qacc

    def _mass_matrix(self) -> Array:
        made = np.empty((self.model.nv, self.model.nv))
        # mj_fullM takes other arguments in other versions.
        for row, unit in zip(made, np.eye(self.model.nv), strict=True):
            self.mj.mj_mulM(self.model, self.data, row, unit)
        return made

    def saved(self) -> Array:
        """Everything that its next step depends on."""
        spec = self.mj.mjtState.mjSTATE_INTEGRATION
        state = np.empty(self.mj.mj_stateSize(self.model, spec))
        self.mj.mj_getState(self.model, self.data, state, spec)
        return state

    def restore(self, state: Array) -> None:
        """Go back to what `saved` gave."""
        self.mj.mj_setState(self.model, self.data, state, self.mj.mjtState.mjSTATE_INTEGRATION)

    def is_stable(self, steps: int, fastest: float) -> bool:
        """Let the body fall without torques: say whether it stays below a speed [rad/s], [m/s]."""
        before = self.saved()
        self.data.qfrc_applied[:] = 0.0
        self.mj.mj_step(self.model, self.data, nstep=steps)
        sound = bool(
            (np.abs(self.data.qvel) < fastest).all() and not self.data.warning.number.any()
        )
        self.mj.mj_resetData(self.model, self.data)
        self.restore(before)
        return sound


def alike(pairs: Sequence[tuple[Simulator, MujocoBody]]) -> list[MujocoBody]:
    """Keep the bodies that touch the ice with as many ends as ours.

    Raises
    ------
    Missing
        If none does.
    """
    found = [body for sim, body in pairs if body.contacts == touching(sim)]
    if not found:
        raise Missing("no state in which MuJoCo touches the ice as we do")
    return found


class PinocchioBody:
    """Pinocchio's model and data, and a simulator's state; errors as for `MujocoBody`."""

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
        _check(sim, "Pinocchio", upper + np.triu(upper, 1).T, bias)


def _check(sim: Simulator, tool: str, inertia: Any, bias: Any) -> None:
    q, v = sim.q, sim.v
    for ours, theirs in ((sim.mass_matrix(q), inertia), (sim.bias_forces(q, v), bias)):
        off = float(np.abs(ours - theirs).max() / np.abs(ours).max())
        if off > AGREEMENT:
            raise RuntimeError(f"{tool} has another body: {off:.1e} off, allowed {AGREEMENT:.0e}")
