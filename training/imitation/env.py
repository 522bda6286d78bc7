"""Environments with an imitation reward (Peng et al. 2018) for the closed step."""

from collections.abc import Sequence
from dataclasses import dataclass
from itertools import pairwise
from typing import Any

import numpy as np
from numpy.typing import NDArray

from skate_env import Scene
from skate_env.gait import ORDER, StepOrder, step_orders
from skate_env.learning.rollouts import DOUBLE
from skate_env.sb3 import IceSkateVecEnv, Infos

from ..orbits.push_only import TICK
from .reference import Reference

Array = NDArray[np.float64]

# Residual torque of a full action [N m]: 150 N m, less where the closed step needs little.
ACTION_SCALE = {f"q{i}": 150.0 for i in (2, 3, 4, 5, 8, 9, 10)}
ACTION_SCALE |= {"q6": 100.0, "q7": 100.0, "q17": 40.0}
ACTION_SCALE |= {"q11": 12.0, "q12": 12.0, "q13": 3.0, "q14": 12.0, "q15": 12.0, "q16": 3.0}
# Weight of a joint's deviation: arms and neck count less.
_ARMS, _NECK = 0.2, 0.1
_JOINT_WEIGHTS = np.array([1.0] * 10 + [_ARMS] * 6 + [_NECK])
# Milliseconds before the swap without a start.
_LAST = 20
# Groups of contact states: free foot in the air, on an end, flat, and flat with the other rolling.
_GROUPS = np.array([0] * 5 + [1] * 8 + [2, 3] * 4)


@dataclass(frozen=True)
class Terms:
    """Weights and limits of the reward.

    For each second: terms of the motion, exp(-deviation / width), and of the contact state. At
    a swap of the legs: the term of the order. An episode ends with a penalty at a fall and where
    the motion is far from the step; then the swap has no reward.
    """

    pose: float = 0.5
    """Weight of the joint angles."""
    pose_width: float = 0.5
    """Of the weighted sum of squares [rad2]."""
    velocity: float = 0.15
    """Weight of the joint rates."""
    velocity_width: float = 60.0
    """[rad2/s2]."""
    slip: float = 0.6
    """Weight of the velocity of the supporting foot."""
    slip_width: float = 0.4
    """[m2/s2]."""
    contact: float = 0.5
    """Half of it for the same contacts of the free foot, half for the same state of Table 2."""
    effort: float = 0.05
    """Weight of the mean square of the actions."""
    order: float = 0.2
    """For a step in the paper's order with double support; a part for a part of the order."""
    end: float = 0.2
    """Penalty of the end of an episode."""
    shortest: float = 0.6
    """Shortest step [s]."""
    late: float = 0.25
    """Longest delay of the swap [s]."""
    pose_limit: float = 3.0
    """Largest deviation of the angles, as for `pose_width` [rad2]."""
    slip_limit: float = 1.5
    """Largest deviation of the velocity of the supporting foot [m/s]."""
    contact_limit: float = 0.1
    """Longest time in other contacts; time in the same ones is subtracted [s]."""


class ImitationVecEnv(IceSkateVecEnv):
    """A batch whose episodes start anywhere on the step.

    Parameters
    ----------
    num_envs
        Number of environments.
    scene
        Of `reference.scene`.
    step
        The step.
    terms
        Of the reward.
    middle
        Share of the episodes that do not start at the beginning of the step.
    perturb
        Largest perturbation of the starts at the beginning, see `IceSkateEnv`.
    seed
        Of the starts.
    max_episode_steps
        Time limit [actions].
    """

    def __init__(
        self,
        num_envs: int,
        scene: Scene,
        step: Reference,
        terms: Terms,
        *,
        middle: float,
        perturb: float,
        seed: int,
        max_episode_steps: int,
    ) -> None:
        super().__init__(
            num_envs,
            max_episode_steps=max_episode_steps,
            num_threads=1,
            scene=scene,
            joints="all",
            action_scale=ACTION_SCALE,
        )
        self.seed(seed)
        self.steps: list[StepOrder] = []
        self._terms, self._step = terms, step
        self._middle, self._perturb = middle, perturb
        self._limit = max_episode_steps
        self._random = np.random.default_rng(seed)
        self._period = scene.parameters()["control.action_period"][0]
        names = list(self.batch.observation_names)
        self._angles = [names.index(f"angle.q{i}") for i in range(1, 18)]
        self._rates = [names.index(f"rate.q{i}") for i in range(1, 18)]
        self._slip, self._state = names.index("slip.support"), names.index("state.0")
        # Time since the swap, time in other contacts, time of the last swap (NaN in a part of a
        # step), supporting leg and number of steps. The legs may swap twice in an action.
        self._time, self._other, self._swap = np.zeros((3, num_envs))
        self._seen = [("right", 0)] * num_envs

    def reset(self) -> NDArray[np.float32]:
        """Start all episodes."""
        super().reset()
        return self._start(range(self.num_envs))

    def step_wait(
        self,
    ) -> tuple[NDArray[np.float32], NDArray[np.float32], NDArray[np.bool_], Infos]:
        """Apply the actions; an ended episode restarts at once."""
        observations, _, ended, infos = super().step_wait()
        seen = observations.astype(np.float64)
        for i in np.flatnonzero(ended).tolist():
            seen[i] = infos[i]["terminal_observation"]
        cut = np.array([info["TimeLimit.truncated"] for info in infos])
        self._time += self._period
        swap_rewards, early = self._swaps(ended, infos)
        reward, far = self._imitation(seen)
        far = (far | early) & ~ended
        reward += np.where(far | (ended & ~cut), -self._terms.end, swap_rewards)
        for i in np.flatnonzero(far).tolist():
            infos[i]["terminal_observation"] = observations[i].copy()
        over = ended | far
        if over.any():
            observations = self._start(np.flatnonzero(over).tolist())
        return observations, reward.astype(np.float32), over, infos

    def _imitation(self, seen: Array) -> tuple[Array, NDArray[np.bool_]]:
        """Return the reward of the period, and where the motion is far from the step."""
        terms, step = self._terms, self._step
        at = step.at(self._time)
        off = seen[:, self._angles] - step.q[at, 2:]
        off = (off + np.pi) % (2.0 * np.pi) - np.pi
        pose = off**2 @ _JOINT_WEIGHTS
        velocity = (seen[:, self._rates] - step.v[at, 2:]) ** 2 @ _JOINT_WEIGHTS
        slip = seen[:, self._slip] - step.v[at, 0]
        state = seen[:, self._state : self._state + len(_GROUPS)].argmax(axis=1)
        same_contacts = (_GROUPS[state] == _GROUPS[step.states[at]]) & (state != 0)
        same = 0.5 * (same_contacts * 1.0 + (state == step.states[at]))
        self._other += np.where(same > 0.0, -self._period, self._period)
        np.maximum(self._other, 0.0, out=self._other)
        rate = (
            terms.pose * np.exp(-pose / terms.pose_width)
            + terms.velocity * np.exp(-velocity / terms.velocity_width)
            + terms.slip * np.exp(-(slip**2) / terms.slip_width)
            + terms.contact * same
            - terms.effort * (self._actions.clip(-1.0, 1.0) ** 2).mean(axis=1)
        )
        far = (pose > terms.pose_limit) | (self._other > terms.contact_limit)
        far |= self._time > step.duration + terms.late
        # In the first moments after a swap the velocity is not yet that of the step.
        far |= (np.abs(slip) > terms.slip_limit) & (self._time > 0.02)
        return rate * self._period, far

    def _swaps(self, ended: NDArray[np.bool_], infos: Infos) -> tuple[Array, NDArray[np.bool_]]:
        """Return the rewards of swaps of the legs, and which swaps are too early."""
        swap_rewards, early = np.zeros(self.num_envs), np.zeros(self.num_envs, np.bool_)
        for i in np.flatnonzero(~ended).tolist():
            seen = infos[i]["support_leg"], infos[i]["steps"]
            if seen == self._seen[i]:
                continue
            self._seen[i] = seen
            events = self.batch.simulator(i).take_events()
            changes = [b[0] for a, b in pairwise(events) if a[4] != b[4]]
            now = changes[-1] if changes else events[-1][0]
            if not np.isnan(self._swap[i]):
                order = step_orders(events, [self._swap[i], now])[-1]
                self.steps.append(order)
                swap_rewards[i] = self._swap_reward(order, self._time[i])
            early[i] = self._time[i] < self._terms.shortest
            self._swap[i], self._time[i] = now, 0.5 * self._period
        return swap_rewards, early

    def _swap_reward(self, order: StepOrder, time: float) -> float:
        """Return the reward of a complete step."""
        share = order.reached / len(ORDER)
        whole = float(share == 1.0)
        length = min(time / self._step.duration, 1.0)
        double = min(order.double / (2.0 * DOUBLE), 1.0)
        return self._terms.order * (0.25 * (share + whole) * length + 0.5 * whole * double)

    def _start(self, which: Sequence[int]) -> NDArray[np.float32]:
        """Start episodes on the step; return the observations of all."""
        for i in which:
            middle = self._random.random() < self._middle
            row = int(self._random.integers(1, len(self._step.q) - _LAST)) if middle else 0
            started = self._start_at(i, row)
            if started is None:
                row = 0
                started = self._start_at(i, row)
                assert started is not None
            observations = started
            self._time[i], self._other[i], self._seen[i] = TICK * row, 0.0, ("right", 0)
            self._swap[i] = np.nan if row else 0.0
        return observations

    def _start_at(self, i: int, row: int) -> NDArray[np.float32] | None:
        """Start an episode at a row of the step; None where it is not a start.

        The supporting foot may leave the ice there without the torques of the step.
        """
        mask = np.zeros(self.num_envs, np.bool_)
        mask[i] = True
        options: dict[str, Any] = {
            "reset_mask": mask,
            "elapsed": self._random.integers(0, self._limit // 2, self.num_envs),
            # A perturbation within the step lifts feet from the ice.
            "perturb": 0.0 if row else float(self._random.uniform(0.0, self._perturb)),
            "state": {"q": self._step.q[row], "v": self._step.v[row], "support_leg": "right"},
        }
        observations, infos = self.batch.reset(options=options)
        return np.asarray(observations) if infos["support_leg"][i] == "right" else None
