"""An environment of the same body in MuJoCo, as somebody at home there would write it."""

from typing import Any

import gymnasium
import numpy as np
from numpy.typing import NDArray

from ..._core import Scene, Simulator
from ...env_config import TORQUE_SCALE
from ...mjcf import to_mjcf
from .peers import package
from .states import PERIOD, STEP

Array = NDArray[np.float64]

_ROOT = 3
_NOISE = 0.01
# An episode ends with the head's height outside of these [m].
_HEALTHY = (1.0, 2.5)


class MujocoSkateEnv(gymnasium.Env[Array, NDArray[np.float32]]):
    """Residual torques in, positions and velocities out; soles touch the ice.

    The body, its damping, the ice, the scales of the torques and the time that an action is held
    are those of ``IceSkate-v0``; the timestep [s] is the shorter one of accuracy `fast`, if no
    other is given. There is no controller. The reward is speed, plus a head held up, minus effort.
    Episodes end with a fall.

    Raises
    ------
    Missing
        If MuJoCo is not installed.
    """

    def __init__(self, scene: Scene, timestep: float = STEP, integrator: str = "Euler") -> None:
        self.mj = mj = package("mujoco")
        start = Simulator(scene)
        self.model = mj.MjModel.from_xml_string(to_mjcf(scene, timestep=timestep, contact=True))
        self.model.opt.integrator = getattr(mj.mjtIntegrator, f"mjINT_{integrator.upper()}")
        self.data = mj.MjData(self.model)
        self._q, self._v = start.q, start.v
        self.torques = np.array([TORQUE_SCALE[joint] for joint in start.coordinate_names[_ROOT:]])
        self._head = self.model.body("head").id
        self._frames = round(PERIOD / timestep)
        size = self.model.nq + self.model.nv
        self.observation_space = gymnasium.spaces.Box(-np.inf, np.inf, (size,), np.float64)
        self.action_space = gymnasium.spaces.Box(-1.0, 1.0, self.torques.shape, np.float32)

    def reset(
        self, *, seed: int | None = None, options: dict[str, Any] | None = None
    ) -> tuple[Array, dict[str, Any]]:
        """Start from the scene's start with noise on joints and rates."""
        super().reset(seed=seed)
        noise = self.np_random.normal(0.0, _NOISE, (2, len(self.torques)))
        self.mj.mj_resetData(self.model, self.data)
        self.data.qpos[:], self.data.qvel[:] = self._q, self._v
        self.data.qpos[_ROOT:] += noise[0]
        self.data.qvel[_ROOT:] += noise[1]
        return self._observation(), {}

    def step(self, action: NDArray[np.float32]) -> tuple[Array, float, bool, bool, dict[str, Any]]:
        """Hold torques over one period."""
        data = self.data
        before = data.qpos[0]
        data.qfrc_applied[_ROOT:] = self.torques * action
        self.mj.mj_step(self.model, data, nstep=self._frames)
        height = data.xpos[self._head, 2]
        effort = float(np.square(action).sum())
        reward = float(data.qpos[0] - before) + PERIOD * (0.5 - 0.1 * effort)
        return self._observation(), reward, not _HEALTHY[0] < height < _HEALTHY[1], False, {}

    def _observation(self) -> Array:
        return np.concatenate((self.data.qpos, self.data.qvel))
