"""The Gymnasium environment ``IceSkate-v0``."""

import json
from pathlib import Path
from typing import Any

import gymnasium
import numpy as np
from gymnasium import spaces
from numpy.typing import NDArray

from ._core import Scene, Simulator
from .perturb import checked_sigma, perturbed_start
from .render.for_env import EnvPictures
from .scenes import load_scene, replace

# Residual torque of a full action [N m]. The legs and the yaw have the largest amplitude that the
# paper prints for them (Eqs. 17 to 22). It prints none for the others: the supporting hip has that
# of the free hip, the trunk that of the yaw, and the light arms and the head have what moves them.
TORQUE_SCALE = {
    "q2": 205.0,
    "q3": 50.0,
    "q4": 100.0,
    "q5": 100.0,
    "q6": 20.0,
    "q7": 50.0,
    "q8": 30.0,
    "q9": 30.0,
    "q10": 30.0,
    "q11": 10.0,
    "q12": 5.0,
    "q13": 1.0,
    "q14": 10.0,
    "q15": 5.0,
    "q16": 1.0,
    "q17": 5.0,
}
# Bounds of the observation; values beyond them are clipped.
_ANGLE, _RATE, _SPEED, _HEAD_ERROR, _TORQUE = np.pi, 50.0, 20.0, 2.0, 20.0
# Reward per second for a head held at standing height, and cost per second of a full action.
_HEAD_RATE, _EFFORT_RATE = 0.5, 0.1
# Coordinates before the joints: y0, z0, q1.
_ROOT = 3
_STATES = 21

Observation = NDArray[np.float32]


class IceSkateEnv(gymnasium.Env[Observation, Observation]):
    """Skating with a residual torque on top of the paper's controller.

    ## Description
    The 17-link humanoid of Zhang et al. skates under the scene's own controller; the action adds
    to its torques. The zero action is the scene's replay, bit for bit.

    ## Action Space
    ``Box(-1, 1, (j,), float32)``, one number per joint q2 .. q17 (j = 16 when the scene locks
    none), times `TORQUE_SCALE` [N m], held over the scene's action period (10 ms). Joints are
    counted from the supporting foot, as in the paper: q2 is always the supporting ankle.

    ## Observation Space
    ``Box`` of float32 with finite bounds; values beyond them are clipped.

    | part | size | unit | bound |
    |---|---|---|---|
    | q1 and the joint angles | j + 1 | rad | pi |
    | their rates | j + 1 | rad/s | 50 |
    | velocity of the supporting foot along y, z | 2 | m/s | 20 |
    | contact state, one-hot: Table 2's rows 1 to 20, and 0 in flight | 21 | | 1 |
    | supporting leg, +1 right, -1 left | 1 | | 1 |
    | head minus its target, x, y, z | 3 | m | 2 |
    | joint torque divided by `TORQUE_SCALE` | j | | 20 |

    The target is that of visual lifting (Eq. 14); without lifting, the head's place when standing.

    ## Rewards
    The sum of three terms, each in the info as well:
    `reward_slide`, the way that the supporting foot slides forward on the ice [m];
    `reward_head`, 0.5 per second with the head at standing height, 0 where it counts as fallen;
    `reward_effort`, minus 0.1 per second times the mean square of the action.

    ## Starting State
    The scene's start. With ``perturb`` above 0 each reset disturbs it (see `perturbed_start`).

    ## Episode End
    Terminated when the simulation cannot go on, the cause in ``info["end_cause"]``; truncated by
    the time limit alone (3000 actions, registered with the environment).

    ## Arguments
    ``scene``: a `Scene`, a preset's name or the path of a scene file. ``perturb``: size of the
    start's disturbance [rad, rad/s and relative speed]. ``accuracy``: instead of the scene's own,
    ``"fast"``, ``"balanced"``, ``"reference"``, a tolerance, or a method's table; see
    ``docs/accuracy.md``. ``render_mode``: None; ``"rgb_array"``, where ``render()`` gives a
    picture (540, 960, 3); or ``"human"``, where ``reset`` and ``step`` show it in a window (extra
    ``render``) until somebody closes it.

    ## Version History
    v0: first form.
    """

    # As Gymnasium declares it: an instance may replace it.
    metadata: dict[str, Any] = EnvPictures.metadata(0.01)

    def __init__(
        self,
        scene: Scene | str | Path = "paper",
        perturb: float = 0.0,
        accuracy: str | float | dict[str, Any] | None = None,
        render_mode: str | None = None,
    ) -> None:
        self._scene = scene if isinstance(scene, Scene) else load_scene(scene)
        if accuracy is not None:
            self._scene = replace(self._scene, {"accuracy": accuracy})
        self._sim = Simulator(self._scene)
        self._perturb = checked_sigma(perturb)
        self.render_mode = render_mode
        self.metadata = EnvPictures.metadata(self._sim.action_period)
        self._pictures = EnvPictures(render_mode, self._sim.action_period, lambda: self._sim)
        joints = self._sim.coordinate_names[_ROOT:]
        self._scale = np.array([TORQUE_SCALE[joint] for joint in joints])
        self._steps = 0
        fields = json.loads(self._scene.to_json())
        # Without fall detection the posture's reward ends at the ice.
        self._fall_height: float = fields["fall"]["head_height"] if fields["fall"] else 0.0
        upright = self._sim.link_segments(np.zeros(len(self._sim.coordinate_names)))
        self._standing_height = float(upright[16, 1, 2])
        # The head's target from the supporting ankle and the ice (3,) [m].
        self._target = np.array([0.0, 0.0, self._standing_height])
        if lifting := fields["control"]["lifting"]:
            self._target[1:] = lifting["ahead"], lifting["height"]
        self.action_space = spaces.Box(-1.0, 1.0, (len(joints),), np.float32)
        bounds = [
            np.full(len(joints) + 1, _ANGLE),
            np.full(len(joints) + 1, _RATE),
            np.full(2, _SPEED),
            np.ones(_STATES + 1),
            np.full(3, _HEAD_ERROR),
            np.full(len(joints), _TORQUE),
        ]
        high = np.concatenate(bounds).astype(np.float32)
        self.observation_space = spaces.Box(-high, high, dtype=np.float32)

    def reset(
        self, *, seed: int | None = None, options: dict[str, Any] | None = None
    ) -> tuple[Observation, dict[str, Any]]:
        """Start an episode; the same seed gives the same start. There are no options."""
        super().reset(seed=seed)
        if self._perturb > 0.0:
            perturbed_start(self._sim, self._perturb, int(self.np_random.integers(2**32)))
        else:
            self._sim.reset()
        self._sim.take_steps()
        self._steps = 0
        self._pictures.after_reset()
        return self._observe(), self._info()

    def step(self, action: Observation) -> tuple[Observation, float, bool, bool, dict[str, Any]]:
        """Hold the residual ``TORQUE_SCALE * action`` over one action period.

        Numbers beyond -1 and 1 count as -1 and 1. An action is refused, and nothing changes, with
        a TypeError where it does not consist of real numbers, with a ValueError where its shape
        is not that of the action space or a number is not finite.
        """
        residual = np.clip(self._checked(action), -1.0, 1.0)
        goes_on = self._sim.step(self._scale * residual)
        self._steps += len(self._sim.take_steps())
        terms = self._rewards(residual)
        self._pictures.after_step()
        return self._observe(), sum(terms.values()), not goes_on, False, self._info() | terms

    def render(self) -> NDArray[np.uint8] | None:
        """Draw the present state (540, 960, 3) in mode "rgb_array", otherwise nothing."""
        return self._pictures.render()

    def close(self) -> None:
        """Close the window, if there is one."""
        self._pictures.close()

    def _checked(self, action: Observation) -> NDArray[np.float64]:
        try:
            given = np.asarray(action)
        except ValueError as error:
            raise ValueError(f"action: not an array of numbers: {error}") from None
        shape = self._scale.shape
        if given.dtype.kind not in "fiu":
            raise TypeError(f"action has dtype {given.dtype}: must be {shape[0]} real numbers")
        if given.shape != shape:
            raise ValueError(f"action has shape {given.shape}: must be {shape}")
        bad = np.flatnonzero(~np.isfinite(given))
        if bad.size:
            raise ValueError(f"action[{bad[0]}] = {given[bad[0]]}: must be finite")
        return given.astype(np.float64)

    def _rewards(self, residual: NDArray[np.float64]) -> dict[str, float]:
        sim, dt = self._sim, self._sim.action_period
        state = sim.state_number
        # Table 2: within each group of four, the third and fourth state slide on the support.
        slides = state > 0 and (state - 1) % 4 >= 2
        head = sim.head_position[2] - self._fall_height
        posture = np.clip(head / (self._standing_height - self._fall_height), 0.0, 1.0)
        return {
            "reward_slide": float(dt * max(sim.v[0], 0.0)) if slides else 0.0,
            "reward_head": float(dt * _HEAD_RATE * posture),
            "reward_effort": float(-dt * _EFFORT_RATE * np.mean(residual**2)),
        }

    def _observe(self) -> Observation:
        sim = self._sim
        q, v = sim.q, sim.v
        state = np.zeros(_STATES)
        state[sim.state_number] = 1.0
        side = 1.0 if sim.support_leg == "right" else -1.0
        ankle = np.array([0.0, sim.link_segments()[1, 0, 1], 0.0])
        head_error = sim.head_position - ankle - self._target
        torque = sim.torque[_ROOT:] / self._scale
        parts = [q[2:], v[2:], v[:2], state, [side], head_error, torque]
        space = self.observation_space
        assert isinstance(space, spaces.Box)
        return np.clip(np.concatenate(parts).astype(np.float32), space.low, space.high)

    def _info(self) -> dict[str, Any]:
        sim = self._sim
        return {
            "time": sim.time,
            "state_number": sim.state_number,
            "support_leg": sim.support_leg,
            "steps": self._steps,
            "end_cause": sim.end_cause,
        }
