"""IceSkate-v0 for training: selected joints, mirrored observations, training reward."""

from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np
from gymnasium import spaces
from numpy.typing import NDArray
from stable_baselines3 import PPO
from stable_baselines3.common.running_mean_std import RunningMeanStd
from stable_baselines3.common.vec_env import VecNormalize

from .._core import Scene
from ..env_config import joints
from ..mirror import Mirror
from ..sb3 import IceSkateVecEnv, Infos
from ..scenes import as_scene, replace
from .reward import COUNTED, Counts, Reward, Weights

Observations = NDArray[np.float32]

# Infos at the end of an episode; `TrainingEnv.episodes` adds the slide.
EPISODE = ("time", "steps", "flight_time", "double_support_time")
# Infos that are read after every action.
READ = (*COUNTED, "reward_slide", "state_number")


class TrainingEnv(IceSkateVecEnv):
    """A batch for training with mirrored observations in left support.

    Parameters
    ----------
    num_envs
        Number of environments; their first time limits are spread evenly.
    scene
        A `Scene`, a preset's name, or the path of a scene file.
    torques
        Residual torque of a full action by joint [N m]; other joints have no residual.
    weights
        Weights of the reward.
    accuracy
        Accuracy of the engine.
    mirrored
        Whether states with left support are mirrored to right support.
    keywords
        Further keywords of `IceSkateVecEnv`, such as ``perturb``.
    """

    progress = 0.0
    """Stage of the reward, 0 to 1; set by the training."""

    def __init__(
        self,
        num_envs: int,
        scene: Scene | str | Path,
        torques: Mapping[str, float],
        weights: Weights,
        *,
        accuracy: str | Mapping[str, Any],
        mirrored: bool = True,
        **keywords: Any,
    ) -> None:
        scene = as_scene(scene)
        self.accuracy = accuracy
        self._others = {"torques": torques, "weights": weights, "mirrored": mirrored, **keywords}
        every = joints(scene)
        self.torques = dict.fromkeys(every, 0.0) | dict(torques)
        self.scene = scene
        # Training does not use the energy balance.
        without_balance = replace(scene, {"energy_balance": False})
        super().__init__(
            num_envs,
            stagger=True,
            scene=without_balance,
            action_scale=self.torques,
            accuracy=accuracy,
            **keywords,
        )
        names = self.batch.observation_names
        self.joints = [i for i, joint in enumerate(every) if joint in torques]
        self.action_space = spaces.Box(-1.0, 1.0, (len(self.joints),), np.float32)
        self.mirror, self.mirror_action = Mirror(names), Mirror(every)
        self.leg = names.index("support_leg")
        self._mirrored = mirrored
        self._reward = Reward(weights, names)
        self.terms: dict[str, float] = {}
        """Sums of the reward's terms over all actions since the last call of `clear`."""
        self.episodes: list[tuple[float, ...]] = []
        """`EPISODE` and the loaded slide [m] of each episode that has ended since then."""

    def under(self, accuracy: str, max_episode_steps: int) -> "TrainingEnv":
        """Build the same environments with another accuracy and time limit, at the first stage."""
        others = self._others | {"accuracy": accuracy, "max_episode_steps": max_episode_steps}
        return TrainingEnv(self.num_envs, self.scene, **others)

    def reset(self) -> Observations:
        """Start all episodes."""
        observations = super().reset()
        begun = {key: np.array([info[key] for info in self.reset_infos]) for key in COUNTED}
        self._counts, self._slide = Counts(begun), np.zeros(self.num_envs)
        self._return, self._length = np.zeros(self.num_envs), np.zeros(self.num_envs, int)
        self._left = self._on_left(observations)
        return self._mirror_left(observations, self._left)

    def step_async(self, actions: NDArray[np.float32]) -> None:
        """Set the actions (n, chosen joints)."""
        self._command = np.clip(actions, -1.0, 1.0)
        whole = np.zeros((self.num_envs, len(self.torques)), np.float32)
        whole[:, self.joints] = self._command
        whole[self._left] = self.mirror_action(whole[self._left])
        super().step_async(whole)

    def step_wait(self) -> tuple[Observations, NDArray[np.float32], NDArray[np.bool_], Infos]:
        """Apply the actions; an ended episode restarts, its info has the final observation."""
        observations, _, terminated, truncated, begun = self.batch.step(self._actions)
        done = terminated | truncated
        ended = np.flatnonzero(done)
        info, last = begun, observations
        if ended.size:
            final = begun["final_info"]
            info = {key: np.where(done, final[key], begun[key]) for key in READ}
            last = observations.copy()
            last[ended] = np.stack([begun["final_obs"][i] for i in ended])
        terms = self._reward.terms(
            self.progress, self._counts, info, last, self._command, terminated
        )
        for name, values in terms.items():
            self.terms[name] = self.terms.get(name, 0.0) + float(values.sum())
        rewards = np.sum(list(terms.values()), axis=0)
        self._return += rewards
        self._length += 1
        self._slide += info["reward_slide"]
        # Running episodes share one empty dictionary, which is not modified.
        infos: Infos = [{}] * self.num_envs
        if ended.size:
            shown = self._mirror_left(last[ended], self._on_left(last[ended]))
            ended_episodes = (*(info[key][ended] for key in EPISODE), self._slide[ended])
            self.episodes += zip(*ended_episodes, strict=True)
            for i, seen in zip(ended.tolist(), shown, strict=True):
                infos[i] = {
                    "terminal_observation": seen,
                    "TimeLimit.truncated": bool(truncated[i] and not terminated[i]),
                    "episode": {"r": self._return[i], "l": int(self._length[i]), "t": 0.0},
                }
            self._counts.replace(done, Counts(begun))
            self._return[ended], self._length[ended], self._slide[ended] = 0.0, 0, 0.0
        self._left = self._on_left(observations)
        seen = self._mirror_left(observations, self._left)
        return seen, rewards.astype(np.float32), done, infos

    def _on_left(self, observations: Observations) -> NDArray[np.bool_]:
        return self._mirrored & (observations[:, self.leg] < 0.0)

    def _mirror_left(self, observations: Observations, left: NDArray[np.bool_]) -> Observations:
        return np.where(left[:, None], self.mirror(observations), observations)


def environments(model: PPO) -> tuple[VecNormalize, RunningMeanStd, TrainingEnv]:
    """Return a learner's normaliser, the observation statistics and the environments.

    Raises
    ------
    TypeError
        If the learner's environments are not a `TrainingEnv` in a `VecNormalize`.
    """
    normaliser = model.get_env()
    if not isinstance(normaliser, VecNormalize) or not isinstance(normaliser.venv, TrainingEnv):
        raise TypeError(f"{type(normaliser).__name__}: must be a TrainingEnv in a VecNormalize")
    if not isinstance(normaliser.obs_rms, RunningMeanStd):
        raise TypeError(f"observations are {type(normaliser.obs_rms).__name__}: must be vectors")
    return normaliser, normaliser.obs_rms, normaliser.venv
