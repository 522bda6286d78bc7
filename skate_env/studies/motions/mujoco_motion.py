"""A motion in MuJoCo, with the coordinates of the engine."""

import math

import numpy as np

from ..._core import Simulator
from .cases import Array, Case
from .mujoco_model import Setting, is_fixed, load, package

# Coordinates before the joints: y0, z0, q1.
_ROOT = 3
# Row of the supporting foot in `Simulator.link_segments`.
_FOOT = 0


class Motion:
    """A motion of a case in MuJoCo."""

    def __init__(self, case: Case, setting: Setting, start: int) -> None:
        self.mj = package()
        self.model = load(case, setting)
        self.data = self.mj.MjData(self.model)
        self.steps = 0
        sim = Simulator(case.scene)
        sim.reset(*case.start(start))
        self.begun = sim.q
        self._length = float(np.ptp(sim.link_segments(np.zeros_like(sim.q))[_FOOT, :, 1]))
        # Coordinates without a joint in MuJoCo's model keep their values.
        self._fixed = _ROOT if is_fixed(case) else 0
        q, v = sim.q, sim.v
        self._root = q[: self._fixed], v[: self._fixed]
        self.data.qpos[:], self.data.qvel[:] = q[self._fixed :], v[self._fixed :]
        if case.torque is not None:
            self.data.qfrc_applied[_ROOT - self._fixed :] = case.torque
        friction = [f"ice.friction.mu_{way}" for way in ("forward", "backward")]
        numbers = case.scene.parameters()
        self._mu = [numbers[name][0] for name in friction if name in numbers]
        self._rewrites = not case.smooth and len(self._mu) == 2

    @property
    def friction(self) -> float | None:
        """Friction coefficient of the sole's contacts; None without contacts."""
        return float(self.model.pair_friction[0, 0]) if self.model.npair else None

    @friction.setter
    def friction(self, value: float | None) -> None:
        if value is not None:
            self.model.pair_friction[:, :2] = value

    def advance(self, steps: int) -> None:
        """Make `steps` steps of the timestep."""
        self.steps += steps
        if not self._rewrites:
            if steps:
                self.mj.mj_step(self.model, self.data, nstep=steps)
            return
        forward, backward = self._mu
        q, v, length = self.data.qpos, self.data.qvel, self._length
        friction = self.model.pair_friction[:, :2]
        present = None
        for _ in range(steps):
            along = v[0] + max(0.0, math.sin(q[2])) * length * v[2]
            if (mu := forward if along >= 0.0 else backward) != present:
                friction[:] = present = mu
            self.mj.mj_step(self.model, self.data)

    def is_valid(self) -> bool:
        """Whether MuJoCo has reported no bad values; after a report it resets the state."""
        kinds = self.mj.mjtWarning
        bad = (kinds.mjWARN_BADQPOS, kinds.mjWARN_BADQVEL, kinds.mjWARN_BADQACC)
        return not any(self.data.warning[int(kind)].number for kind in bad)

    def penetration(self) -> float:
        """Depth of the lower end of the supporting sole below the ice [m]."""
        if self._fixed:
            return 0.0
        toe, angle = self.data.qpos[1], self.data.qpos[2]
        return max(0.0, -float(toe - max(0.0, math.sin(angle)) * self._length))

    def state(self) -> tuple[Array, Array]:
        """Return q and v (n,)."""
        q = np.concatenate([self._root[0], self.data.qpos])
        v = np.concatenate([self._root[1], self.data.qvel])
        return q, v
