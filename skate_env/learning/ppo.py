"""PPO (Schulman et al. 2017, arXiv:1707.06347) of Stable-Baselines3 for residual torques.

The initial policy is the baseline: its last layer is zero, so it adds only exploration noise.
Observation statistics and critic are fitted to the baseline before the policy changes. The reward
becomes stricter in stages (`reward`). On one machine a seed determines the policy bit for bit, also
if the training is interrupted and resumed.
"""

import time
from collections.abc import Iterable, Sequence
from dataclasses import asdict
from pathlib import Path
from typing import Any

import numpy as np
import torch
from stable_baselines3 import PPO
from stable_baselines3.common.callbacks import BaseCallback
from stable_baselines3.common.logger import configure
from stable_baselines3.common.vec_env import VecNormalize

from .._core import Scene
from ..policy import Policy
from ..progress import ProgressBar, progress_bar
from ..scenes import load_scene
from ..validation import known
from . import checkpoint
from .configs import CONFIGS, Hyperparameters
from .export import policy_of
from .overrides import override
from .reward import at
from .training_env import TrainingEnv, environments

LEGS = ("q2", "q3", "q4", "q5", "q6", "q7")
TRUNK = ("q8", "q9", "q10")
CHECKPOINT, POLICY = "checkpoint.pkl", "policy.npz"
# Accuracy of the last part of a training; policies are evaluated at it.
FINE = "balanced"
# Time between two checkpoints [s].
CHECKPOINT_PERIOD = 60.0


def training_env_of(
    scene: Scene | str | Path, numbers: Hyperparameters, threads: int
) -> TrainingEnv:
    """Build the environments of a training."""
    torques = dict.fromkeys(LEGS, numbers.leg_torque) | dict.fromkeys(TRUNK, numbers.trunk_torque)
    torques["q17"] = numbers.neck_torque
    return TrainingEnv(
        numbers.envs,
        scene,
        torques,
        numbers.weights,
        mirrored=numbers.mirrored,
        max_episode_steps=numbers.episode,
        accuracy={"method": "moreau", "step": numbers.step},
        perturb=numbers.perturb,
        trunk_noise=numbers.trunk_noise,
        kick=numbers.kick,
        num_threads=threads,
    )


def begin(scene: Scene | str | Path, seed: int, numbers: Hyperparameters, threads: int = 1) -> PPO:
    """Build a learner whose policy is the baseline, with observation statistics of the baseline."""
    env = training_env_of(scene, numbers, threads)
    # The epsilon limits the gain of observations with small variance, such as rare contact states.
    venv = VecNormalize(env, gamma=numbers.gamma, epsilon=1e-2)
    model = PPO(
        "MlpPolicy",
        venv,
        n_steps=numbers.rollout,
        batch_size=numbers.minibatch,
        n_epochs=numbers.epochs,
        learning_rate=lambda left: numbers.rate * (0.1 + 0.9 * left),
        gamma=numbers.gamma,
        gae_lambda=numbers.gae_lambda,
        clip_range=numbers.clip,
        ent_coef=numbers.entropy,
        seed=seed,
        device="cpu",
        policy_kwargs={
            "net_arch": list(numbers.layers),
            "activation_fn": torch.nn.Tanh,
            "optimizer_kwargs": {"eps": 1e-5, "fused": True},
        },
    )
    policy: Any = model.policy
    torch.nn.init.zeros_(policy.action_net.weight)
    venv.reset()
    zero = np.zeros((numbers.envs, len(env.joints)), np.float32)
    for _ in range(numbers.warm_up):
        venv.step(zero)
    return model


class StageCallback(BaseCallback):
    """Sets the stage of the training, freezes the actor at first, logs, and saves checkpoints."""

    def __init__(self, model: PPO, about: dict[str, Any], folder: Path, bar: ProgressBar) -> None:
        super().__init__()
        self._learner = model
        _, _, self._env = environments(model)
        self._numbers: Hyperparameters = about["hyperparameters"]
        self._about, self._folder, self._bar = about, folder, bar
        self._saved = time.monotonic()

    def _on_rollout_start(self) -> None:
        if time.monotonic() - self._saved > CHECKPOINT_PERIOD:
            checkpoint.save(self._learner, self._folder / CHECKPOINT, self._about)
            self._saved = time.monotonic()
        parts = self._numbers.first_until, self._numbers.last_from
        done = self.num_timesteps / self._numbers.actions
        if done >= self._numbers.fine_from and self._env.accuracy != FINE:
            self._go_fine()
        progress = self._env.progress = float(np.interp(done, parts, (0.0, 1.0)))
        policy: Any = self._learner.policy
        for part in (policy.mlp_extractor.policy_net, policy.action_net):
            part.requires_grad_(self.num_timesteps >= self._numbers.critic_first)
        policy.log_std.requires_grad_(False).fill_(np.log(at(progress, self._numbers.noise)))

    def _go_fine(self) -> None:
        """Restart all episodes with the finer accuracy and a longer time limit."""
        normaliser, _, env = environments(self._learner)
        self._env = env.under(FINE, self._numbers.fine_episode)
        normaliser.venv = self._env
        self._env.seed(self._learner.seed)
        # Initial observations of the next rollout.
        self._learner._last_obs = normaliser.reset()
        self._learner._last_episode_starts = np.ones(env.num_envs, np.bool_)

    def _on_step(self) -> bool:
        self._bar.update(self._numbers.envs)
        return True

    def _on_rollout_end(self) -> None:
        env = self._env
        actions = self._numbers.envs * self._numbers.rollout
        seconds = env.batch.action_period * actions
        for name, value in env.terms.items():
            self.logger.record(f"reward/{name}_per_s", value / seconds)
        self.logger.record("training/stage", env.progress)
        if env.episodes:
            duration, steps, flight, double, slide = np.mean(env.episodes, axis=0)
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
        env.terms.clear()
        env.episodes.clear()


def learn(model: PPO, about: dict[str, Any], folder: Path) -> None:
    """Train to the last action; write TensorBoard events into the folder."""
    numbers: Hyperparameters = about["hyperparameters"]
    model.set_logger(configure(str(folder), ["tensorboard"]))
    left = numbers.actions - model.num_timesteps
    with progress_bar(numbers.actions, "train", "action", model.num_timesteps) as bar:
        model.learn(
            left, callback=StageCallback(model, about, folder, bar), reset_num_timesteps=False
        )


def train(
    out: Path,
    scene: str,
    config: str | None,
    seed: int,
    overrides: Iterable[tuple[str, Any]],
    without: Sequence[str],
    threads: int,
) -> Policy:
    """Train a policy; write it, a checkpoint and TensorBoard events into a folder.

    Parameters
    ----------
    out
        The folder; created if missing.
    scene
        Name of a preset, or path of a scene file.
    config
        Name in `CONFIGS`; None for the one named like the scene, or the standard one.
    seed
        Seed of all random numbers, 0 to `skate_env.learning.LAST_TRAINING_SEED`.
    overrides
        Names and new values of hyperparameters.
    without
        Effects to remove from the scene.
    threads
        Threads of the environments.

    Raises
    ------
    ValueError
        If a name or a value is invalid.
    OSError
        If a file cannot be read or written.
    """
    torch.set_num_threads(1)
    chosen = load_scene(scene)
    known("config", [config] if config else [], CONFIGS)
    numbers = override(CONFIGS.get(config or chosen.name, Hyperparameters()), overrides)
    for effect in without:
        chosen = chosen.without(effect)
    model = begin(chosen, seed, numbers, threads)
    about = {"scene": scene, "without": list(without), "seed": seed, "hyperparameters": numbers}
    return _finish(model, about, out)


def resume(out: Path) -> Policy:
    """Continue a training from the checkpoint in its folder; errors as of `train`."""
    torch.set_num_threads(1)
    model, about = checkpoint.load(out / CHECKPOINT)
    return _finish(model, about, out)


def _finish(model: PPO, about: dict[str, Any], out: Path) -> Policy:
    out.mkdir(parents=True, exist_ok=True)
    learn(model, about, out)
    checkpoint.save(model, out / CHECKPOINT, about)
    policy = policy_of(model, about | {"hyperparameters": asdict(about["hyperparameters"])})
    policy.save(out / POLICY)
    return policy
