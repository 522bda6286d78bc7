"""PPO (Schulman et al. 2017, arXiv:1707.06347) of Stable-Baselines3 for residual torques.

The environment is `IceSkateVecEnv` with its own reward. The last part of a training has the
accuracy of evaluations. On one machine a seed determines the policy bit for bit, also if the
training is interrupted and resumed.
"""

import math
import time
from collections.abc import Callable, Iterable, Sequence
from dataclasses import asdict, dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np
import torch
from stable_baselines3 import PPO
from stable_baselines3.common.callbacks import BaseCallback
from stable_baselines3.common.logger import configure
from stable_baselines3.common.vec_env import VecNormalize

from .._core import Scene
from ..common import ProgressBar, prepare_folder, progress_bar
from ..policies import Policy
from ..sb3 import IceSkateVecEnv
from ..scenes import load_scene
from ..scenes import replace as with_changes
from . import checkpoint
from .average import Average
from .checkpoint import environments
from .configs import CONFIGS, Hyperparameters
from .export import digest, policy_of
from .initial import actor, take_over
from .overrides import override

CHECKPOINT, POLICY = "checkpoint.pkl", "policy.npz"
# Accuracy of the last part of a training; policies are evaluated at it.
FINE = "balanced"
# Time between two checkpoints [s].
CHECKPOINT_PERIOD = 60.0
# Infos at the end of an episode that are logged.
EPISODE = ("time", "steps", "flight_time", "double_support_time", "loaded_slide")


@dataclass(frozen=True)
class Training:
    """All inputs of a training.

    Attributes
    ----------
    scene
        Scene of the policy with its original accuracy.
    seed
        Seed of all random numbers.
    numbers
        Hyperparameters.
    threads
        Threads of the environments.
    about
        Further data for the policy's file, as JSON values.
    """

    scene: Scene
    seed: int
    numbers: Hyperparameters
    threads: int
    about: dict[str, Any]

    def environments(
        self, accuracy: Any, episode: int, reward: dict[str, float] | None = None
    ) -> IceSkateVecEnv:
        """Build the environments of a part of the training."""
        numbers = self.numbers
        return IceSkateVecEnv(
            numbers.envs,
            stagger=True,
            max_episode_steps=episode,
            num_threads=self.threads,
            scene=self.scene,
            accuracy=accuracy,
            reward={"high_speed": numbers.high_speed} | (reward or {}),
            perturb=numbers.perturb,
            trunk_noise=numbers.trunk_noise,
            kick=numbers.kick,
        )


def begin(training: Training) -> PPO:
    """Build a learner with the environments of the first part."""
    numbers = training.numbers
    coarse = {"method": "moreau", "step": numbers.step}
    env = training.environments(coarse, numbers.episode)
    more = {"clip_range": numbers.clip, "ent_coef": numbers.entropy}
    return learner(env, numbers, training.seed, lambda left: 0.1 + 0.9 * left, **more)


def learner(
    env: IceSkateVecEnv, numbers: Any, seed: int, share: Callable[[float], float], **more: Any
) -> PPO:
    """Build PPO from the hyperparameters that every training has, and more.

    ``share`` is that of the learning rate where a part of the training is left.
    """
    return PPO(
        "MlpPolicy",
        VecNormalize(env, gamma=numbers.gamma),
        n_steps=numbers.rollout,
        batch_size=numbers.minibatch,
        n_epochs=numbers.epochs,
        learning_rate=lambda left: numbers.rate * share(left),
        gamma=numbers.gamma,
        gae_lambda=numbers.gae_lambda,
        seed=seed,
        device="cpu",
        policy_kwargs={
            "net_arch": list(numbers.layers),
            "log_std_init": math.log(numbers.noise),
            "optimizer_kwargs": {"eps": 1e-5, "fused": True},
        },
        **more,
    )


class TrainingCallback(BaseCallback):
    """Begins the last part of the training, logs, and saves checkpoints."""

    def __init__(
        self, model: PPO, training: Training, average: Average, folder: Path, bar: ProgressBar
    ) -> None:
        super().__init__()
        self._learner, self._training, self._average = model, training, average
        self._folder, self._bar = folder, bar
        # The first rollout begins with a checkpoint.
        self._saved = -math.inf
        self._terms: dict[str, float] = {}
        self._ended: list[list[float]] = []

    def _on_rollout_start(self) -> None:
        if time.monotonic() - self._saved > CHECKPOINT_PERIOD:
            about = self._training, self._average
            checkpoint.save(self._learner, self._folder / CHECKPOINT, about)
            self._saved = time.monotonic()
        numbers = self._training.numbers
        # The weights of the last rollout's update.
        if self.num_timesteps > numbers.average_from * numbers.actions:
            self._average.add(self._learner)
        critic_alone = numbers.critic_updates * numbers.envs * numbers.rollout
        for parameter in actor(self._learner):
            parameter.requires_grad_(self.num_timesteps >= critic_alone)
        normaliser, _, env = environments(self._learner)
        is_fine = env.batch.scene == with_changes(self._training.scene, {"accuracy": FINE})
        if not is_fine and self.num_timesteps >= numbers.fine_from * numbers.actions:
            # All episodes restart with the finer accuracy and a longer time limit.
            stricter = {"flight": numbers.fine_flight}
            normaliser.venv = self._training.environments(FINE, numbers.fine_episode, stricter)
            normaliser.venv.seed(self._learner.seed)
            # Initial observations of the next rollout.
            self._learner._last_obs = normaliser.reset()
            self._learner._last_episode_starts = np.ones(numbers.envs, np.bool_)

    def _on_step(self) -> bool:
        self._bar.update(self._training.numbers.envs)
        for info, done in zip(self.locals["infos"], self.locals["dones"], strict=True):
            for name, value in info.items():
                if name.startswith("reward_"):
                    self._terms[name] = self._terms.get(name, 0.0) + value
            if done:
                self._ended.append([info[name] for name in EPISODE])
        return True

    def _on_rollout_end(self) -> None:
        numbers = self._training.numbers
        _, _, env = environments(self._learner)
        seconds = env.batch.action_period * numbers.envs * numbers.rollout
        for name, value in self._terms.items():
            self.logger.record(f"reward/{name.removeprefix('reward_')}_per_s", value / seconds)
        if self._ended:
            duration, steps, flight, double, slide = np.mean(self._ended, axis=0)
            statistics = {
                "lasted_s": duration,
                "steps": steps,
                "period_s": duration / max(steps, 1.0),
                "loaded_slide_per_step_m": slide / max(steps, 1.0),
                "flight_share": flight / duration,
                "double_support_share": double / duration,
            }
            for name, value in statistics.items():
                self.logger.record(f"episode/{name}", value)
            self._bar.set_postfix_str(f"{steps:.1f} steps in {duration:.1f} s")
        self._terms.clear()
        self._ended.clear()


def learn(model: PPO, training: Training, average: Average, folder: Path) -> None:
    """Train to the last action; write TensorBoard events into the folder."""
    total = training.numbers.actions
    model.set_logger(configure(str(folder), ["tensorboard"]))
    left = total - model.num_timesteps
    with progress_bar(total, "train", "action", model.num_timesteps) as bar:
        callback = TrainingCallback(model, training, average, folder, bar)
        model.learn(left, callback=callback, reset_num_timesteps=False)


def train(
    out: Path,
    scene: str,
    seed: int,
    overrides: Iterable[tuple[str, Any]],
    without: Sequence[str],
    threads: int,
    first: Path | None = None,
) -> Policy:
    """Train a policy; write it, a checkpoint and TensorBoard events into a folder.

    Parameters
    ----------
    out
        The folder; created if missing.
    scene
        Name of a preset, or path of a scene file.
    seed
        Seed of all random numbers, 0 to `skate_env.learning.LAST_TRAINING_SEED`.
    overrides
        Names and new values of hyperparameters.
    without
        Effects to remove from the scene.
    threads
        Threads of the environments.
    first
        File of the policy that the training begins with.

    Raises
    ------
    ValueError
        If a name or a value is invalid.
    OSError
        If a file cannot be read or written.
    """
    chosen = load_scene(scene)
    numbers = override(CONFIGS.get(chosen.name, Hyperparameters()), overrides)
    for effect in without:
        chosen = chosen.without(effect)
    chosen = with_changes(chosen, {"control.action_period": numbers.period})
    about = {"scene": scene, "without": list(without)}
    return start(Training(chosen, seed, numbers, threads, about), out, first)


def start(training: Training, out: Path, first: Path | None) -> Policy:
    """Make a training from its beginning; arguments and errors are those of `train`."""
    torch.set_num_threads(1)
    policy = None if first is None else Policy.load(first)
    if policy is not None:
        training = replace(training, about=training.about | {"begun_with": digest(policy)})
    model = begin(training)
    if policy is not None:
        take_over(model, policy)
    return _finish(model, training, Average(), out)


def resume(out: Path) -> Policy:
    """Continue a training from the checkpoint in its folder; errors as of `train`."""
    torch.set_num_threads(1)
    model, (training, average) = checkpoint.load(out / CHECKPOINT)
    try:
        # A pickle skips the checks.
        override(training.numbers, [])
    except ValueError as error:
        raise ValueError(f"checkpoint {out / CHECKPOINT}: {error}") from None
    return _finish(model, training, average, out)


def _finish(model: PPO, training: Training, average: Average, out: Path) -> Policy:
    prepare_folder(out)
    learn(model, training, average, out)
    checkpoint.save(model, out / CHECKPOINT, (training, average))
    average.apply(model)
    numbers = {"seed": training.seed, "hyperparameters": asdict(training.numbers)}
    policy = policy_of(model, training.scene, training.about | numbers)
    policy.save(out / POLICY)
    return policy
