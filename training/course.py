"""IceSkate-v0 as a policy learns on it: chosen joints, one view for both legs, own reward."""

from collections.abc import Mapping
from typing import Any

import numpy as np
from gymnasium import spaces
from gymnasium.vector import AutoresetMode
from numpy.typing import NDArray
from stable_baselines3 import PPO
from stable_baselines3.common.running_mean_std import RunningMeanStd
from stable_baselines3.common.vec_env import VecNormalize
from stable_baselines3.common.vec_env.base_vec_env import VecEnv

from skate_env.mirror import Mirror
from skate_env.vector import IceSkateVectorEnv

from .reward import Counts, Reward, Weights

Observations = NDArray[np.float32]

# What is worth knowing of an episode, in this order.
EPISODE = ("time", "steps", "flight_time", "double_support_time", "slide")


class Course(VecEnv):
    """A native batch; what learners see of a skater on the left leg is its mirror image.

    Parameters
    ----------
    num_envs
        How many environments.
    torques
        Residual of a full action by joint [N m]; joints that are not named get none.
    weights
        Of the reward.
    limit
        Actions after which an episode is truncated; first limits are spread evenly.
    mirrored
        Whether skaters on the left leg are shown as on the right one.
    keywords
        Others of `IceSkateVectorEnv`: ``scene``, ``perturb`` and so on.
    """

    progress = 0.0
    """Stage of the course, from 0 to 1; whoever trains moves it."""

    def __init__(
        self,
        num_envs: int,
        torques: Mapping[str, float],
        weights: Weights,
        *,
        limit: int,
        mirrored: bool = True,
        **keywords: Any,
    ) -> None:
        every = IceSkateVectorEnv(1, **keywords).joint_names
        self.torques = dict.fromkeys(every, 0.0) | dict(torques)
        self.batch = IceSkateVectorEnv(
            num_envs,
            max_episode_steps=limit,
            autoreset_mode=AutoresetMode.SAME_STEP,
            action_scale=self.torques,
            slide_weight=1.0,
            **keywords,
        )
        names = self.batch.observation_names
        self.joints = [i for i, joint in enumerate(every) if joint in torques]
        self._all = len(every)
        self.mirror, self.mirror_action = Mirror(names), Mirror(every)
        self.leg = names.index("support_leg")
        self._mirrored = mirrored
        self._reward = Reward(weights, names)
        self._elapsed = np.arange(num_envs) * limit // num_envs
        self.terms: dict[str, float] = {}
        """Sums of the reward's terms over all actions since somebody cleared it."""
        self.episodes: list[tuple[float, ...]] = []
        """Of each that has ended since then, `EPISODE`."""
        action = spaces.Box(-1.0, 1.0, (len(self.joints),), np.float32)
        super().__init__(num_envs, self.batch.single_observation_space, action)

    def reset(self) -> Observations:
        """Begin all episodes."""
        seed = self._seeds[0]
        observations, info = self.batch.reset(seed=seed, options={"elapsed": self._elapsed})
        self._counts, self._slide = Counts(info), np.zeros(self.num_envs)
        self._return, self._length = np.zeros(self.num_envs), np.zeros(self.num_envs, int)
        self._reset_seeds()
        self._reset_options()
        self._left = self._on_left(observations)
        return self._seen(observations, self._left)

    def step_async(self, actions: NDArray[np.float32]) -> None:
        """Take actions (n, chosen joints)."""
        whole = np.zeros((self.num_envs, self._all), np.float32)
        whole[:, self.joints] = actions
        if self._left.any():
            whole[self._left] = self.mirror_action(whole[self._left])
        self._actions = np.clip(whole, -1.0, 1.0)
        self._asked = np.clip(actions, -1.0, 1.0)

    def step_wait(
        self,
    ) -> tuple[Observations, NDArray[np.float32], NDArray[np.bool_], list[dict[str, Any]]]:
        """Make them; episodes that end begin anew, and say in their infos what they ended with."""
        observations, _, terminated, truncated, begun = self.batch.step(self._actions)
        done = terminated | truncated
        ended = np.flatnonzero(done)
        info, last = begun, observations
        if ended.size:
            final = begun["final_info"]
            keys = (*EPISODE[:-1], "reward_slide", "state_number", "y_position")
            info = {key: np.where(done, final[key], begun[key]) for key in keys}
            last = observations.copy()
            last[ended] = np.stack([begun["final_obs"][i] for i in ended])
        terms = self._reward.terms(self.progress, self._counts, info, last, self._asked, terminated)
        for name, values in terms.items():
            self.terms[name] = self.terms.get(name, 0.0) + float(values.sum())
        rewards = np.sum(list(terms.values()), axis=0)
        self._return += rewards
        self._length += 1
        self._slide += info["reward_slide"]
        # Nobody writes to those of episodes that go on.
        infos: list[dict[str, Any]] = [{}] * self.num_envs
        if ended.size:
            shown = self._seen(last[ended], self._on_left(last[ended]))
            rows = zip(*(info[key][ended] for key in EPISODE[:-1]), self._slide[ended], strict=True)
            self.episodes += rows
            for i, seen in zip(ended.tolist(), shown, strict=True):
                infos[i] = {
                    "terminal_observation": seen,
                    "TimeLimit.truncated": bool(truncated[i] and not terminated[i]),
                    "episode": {"r": self._return[i], "l": int(self._length[i]), "t": 0.0},
                }
            self._counts.replace(done, Counts(begun))
            self._return[ended], self._length[ended], self._slide[ended] = 0.0, 0, 0.0
        self._left = self._on_left(observations)
        seen = self._seen(observations, self._left)
        return seen, rewards.astype(np.float32), done, infos

    def _on_left(self, observations: Observations) -> NDArray[np.bool_]:
        return self._mirrored & (observations[:, self.leg] < 0.0)

    def _seen(self, observations: Observations, left: NDArray[np.bool_]) -> Observations:
        return np.where(left[:, None], self.mirror(observations), observations)

    def close(self) -> None:
        """Close the batch."""
        self.batch.close()

    def get_attr(self, attr_name: str, indices: Any = None) -> list[Any]:
        """Return the batch's attribute, once for every index."""
        return [getattr(self.batch, attr_name) for _ in self._get_indices(indices)]

    def set_attr(self, attr_name: str, value: Any, indices: Any = None) -> None:
        """Raise AttributeError: what environments of a batch are is settled when it is made."""
        raise AttributeError(f"{attr_name}: the environments of a batch cannot be changed")

    def env_method(
        self, method_name: str, *method_args: Any, indices: Any = None, **keywords: Any
    ) -> list[Any]:
        """Call the batch's method with every index and the arguments."""
        method = getattr(self.batch, method_name)
        return [method(i, *method_args, **keywords) for i in self._get_indices(indices)]

    def env_is_wrapped(self, wrapper_class: type, indices: Any = None) -> list[bool]:
        """No environment of a batch is wrapped."""
        return [False for _ in self._get_indices(indices)]


def environments(model: PPO) -> tuple[VecNormalize, RunningMeanStd, Course]:
    """Give a learner's normaliser, the observations' mean and variance, and what it normalises.

    Raises
    ------
    TypeError
        If the learner has other environments than a `Course` in a `VecNormalize`.
    """
    normaliser = model.get_env()
    if not isinstance(normaliser, VecNormalize) or not isinstance(normaliser.venv, Course):
        raise TypeError(f"{type(normaliser).__name__}: must be a Course in a VecNormalize")
    if not isinstance(normaliser.obs_rms, RunningMeanStd):
        raise TypeError(f"observations are {type(normaliser.obs_rms).__name__}: must be vectors")
    return normaliser, normaliser.obs_rms, normaliser.venv
