"""A MuJoCo environment of the same body in the usual style of Gymnasium's environments."""

from typing import Any

import gymnasium
import numpy as np
from numpy.typing import NDArray

from skate_env._core import Scene, Simulator
from skate_env.environments import PAPER_ACTIONS
from skate_env.scenes import to_mjcf

from .peers import package
from .states import PERIOD, STEP

Array = NDArray[np.float64]

_ROOT = 3
_NOISE = 0.01
# Range of the head's height [m]; an episode ends outside of it.
_HEALTHY = (1.0, 2.5)


class MujocoSkateEnv(gymnasium.Env[Array, NDArray[np.float32]]):
    """Actions are joint torques, observations are positions and velocities.

    Body, damping, ice, torque scales and action period are those of ``IceSkate-v0``; the default
    timestep [s] is the shorter one of accuracy `fast`. The soles have contact with the ice. There
    is no controller. The reward is displacement plus a survival bonus minus effort. Episodes end
    with a fall.

    Raises
    ------
    Unavailable
        If MuJoCo is not installed.
    """

    def __init__(self, scene: Scene, timestep: float = STEP, integrator: str = "Euler") -> None:
        self.mj = mj = package("mujoco")
        start = Simulator(scene)
        self.model = mj.MjModel.from_xml_string(to_mjcf(scene, timestep=timestep, contact=True))
        self.model.opt.integrator = getattr(mj.mjtIntegrator, f"mjINT_{integrator.upper()}")
        self.data = mj.MjData(self.model)
        self._q, self._v = start.q, start.v
        self.torques = np.array(
            [PAPER_ACTIONS["action_scale"][joint] for joint in start.coordinate_names[_ROOT:]]
        )
        self._head = self.model.body("head").id
        self._frames = round(PERIOD / timestep)
        size = self.model.nq + self.model.nv
        self.observation_space = gymnasium.spaces.Box(-np.inf, np.inf, (size,), np.float64)
        self.action_space = gymnasium.spaces.Box(-1.0, 1.0, self.torques.shape, np.float32)

    def reset(
        self, *, seed: int | None = None, options: dict[str, Any] | None = None
    ) -> tuple[Array, dict[str, Any]]:
        """Reset to the scene's start with noise on joint angles and rates."""
        super().reset(seed=seed)
        noise = self.np_random.normal(0.0, _NOISE, (2, len(self.torques)))
        self.mj.mj_resetData(self.model, self.data)
        self.data.qpos[:], self.data.qvel[:] = self._q, self._v
        self.data.qpos[_ROOT:] += noise[0]
        self.data.qvel[_ROOT:] += noise[1]
        return self._observation(), {}

    def step(self, action: NDArray[np.float32]) -> tuple[Array, float, bool, bool, dict[str, Any]]:
        """Apply constant torques for one action period."""
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
