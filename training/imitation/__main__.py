"""Train a policy that skates in the paper's order on push-only ice."""

import argparse
import json
import math
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Annotated

import numpy as np
import torch
from stable_baselines3 import PPO
from stable_baselines3.common.callbacks import BaseCallback
from stable_baselines3.common.policies import ActorCriticPolicy

from skate_env import Policy, Scene
from skate_env.common import ProgressBar, prepare_file, progress_bar
from skate_env.gait import ORDER
from skate_env.learning.checkpoint import environments
from skate_env.learning.configs import check_sizes
from skate_env.learning.export import policy_of
from skate_env.learning.overrides import Range, check, override
from skate_env.learning.ppo import learner

from .env import ImitationVecEnv, Terms
from .reference import reference, scene

# Steps of which the progress bar shows the share in order.
_SHOWN = 500


@dataclass(frozen=True)
class Hyperparameters:
    """Hyperparameters."""

    actions: Annotated[int, Range(1, 10**12)] = 10_000_000
    """Total number of actions."""
    feedforward: Annotated[tuple[float, ...], Range(1e-3, 10.0)] = (0.2, 0.4, 0.55, 0.7, 0.85, 1.0)
    """Factors of the printed torques, one after the other; the closed step has the first."""
    begins: Annotated[tuple[float, ...], Range(0.0, 0.99)] = (0.0, 0.42, 0.47, 0.52, 0.57, 0.62)
    """Parts of the training at which they begin."""
    period: Annotated[float, Range(1e-4, 1.0)] = 0.01
    """Duration of an action [s]."""
    envs: Annotated[int, Range(1, 100_000)] = 64
    rollout: Annotated[int, Range(1, 100_000)] = 64
    """Actions of each environment between two updates."""
    minibatch: Annotated[int, Range(2, 10_000_000)] = 2048
    epochs: Annotated[int, Range(1, 1000)] = 5
    rate: Annotated[float, Range(0.0, 1.0)] = 5e-4
    """Learning rate; in the last part of the training it decreases linearly to a tenth."""
    gamma: Annotated[float, Range(0.0, 1.0)] = 0.99
    gae_lambda: Annotated[float, Range(0.0, 1.0)] = 0.98
    noise: Annotated[float, Range(1e-3, 10.0)] = 0.15
    """Initial standard deviation of actions, where 1 is a full action."""
    noise_limits: Annotated[tuple[float, float], Range(1e-3, 10.0)] = (0.12, 0.02)
    """Its upper limits at the end of the first part and of the training; linear between them."""
    layers: Annotated[tuple[int, ...], Range(1, 4096)] = (128, 128)
    middle: Annotated[float, Range(0.0, 1.0)] = 0.5
    """Share of the episodes that start within the step."""
    perturb: Annotated[float, Range(0.0, 10.0)] = 0.05
    """Largest perturbation of the starts."""
    episode: Annotated[int, Range(1, 1_000_000)] = 1000
    """Time limit [actions]."""

    def __post_init__(self) -> None:
        check(self)
        check_sizes(self.minibatch, self.envs, self.rollout, self.layers)
        few = len(self.begins) < 2 or len(self.begins) != len(self.feedforward)
        if few or self.begins[0] != 0.0:
            raise ValueError(
                f"begins = {self.begins}: must be 0 and one for each later feedforward"
            )


class Schedule(BaseCallback):
    """Increases the feedforward, and shows the share of the steps in the paper's order."""

    def __init__(self, bar: ProgressBar, numbers: Hyperparameters, seed: int) -> None:
        super().__init__()
        self._bar, self._numbers, self._seed = bar, numbers, seed
        self._reference = reference()
        self._part = 0
        self.envs = self._environments()

    @property
    def scene(self) -> Scene:
        """Of the present part."""
        numbers = self._numbers
        return scene(self._reference, numbers.feedforward[self._part], numbers.period)

    def _environments(self) -> ImitationVecEnv:
        numbers = self._numbers
        return ImitationVecEnv(
            numbers.envs,
            self.scene,
            self._reference,
            Terms(),
            middle=numbers.middle,
            perturb=numbers.perturb,
            seed=self._seed,
            max_episode_steps=numbers.episode,
        )

    def _on_rollout_start(self) -> None:
        done = self.num_timesteps / self._numbers.actions
        self._limit_noise(done)
        part = sum(done >= begin for begin in self._numbers.begins) - 1
        if part == self._part:
            return
        before, self._part = self._part, part
        self.envs = self._environments()
        assert isinstance(self.model, PPO)
        normaliser, moments, _ = environments(self.model)
        normaliser.venv = self.envs
        # What the policy sees of the feedforward grows with it.
        ratio = self._numbers.feedforward[part] / self._numbers.feedforward[before]
        for i, name in enumerate(self.envs.batch.observation_names):
            if name.startswith("feedforward."):
                moments.mean[i] *= ratio
                moments.var[i] *= ratio**2
        self.model._last_obs = normaliser.reset()
        self.model._last_episode_starts = np.ones(self._numbers.envs, np.bool_)

    def _limit_noise(self, done: float) -> None:
        """Limit the standard deviation of the actions at a part of the training."""
        begin = self._numbers.begins[1]
        if done < begin:
            return
        first, last = self._numbers.noise_limits
        limit = first + (last - first) * (done - begin) / (1.0 - begin)
        policy = self.model.policy
        assert isinstance(policy, ActorCriticPolicy)
        with torch.no_grad():
            policy.log_std.clamp_(max=math.log(limit))

    def _on_step(self) -> bool:
        self._bar.update(self._numbers.envs)
        return True

    def _on_rollout_end(self) -> None:
        steps = self.envs.steps
        if len(steps) > _SHOWN:
            complete = sum(step.reached == len(ORDER) for step in steps) / len(steps)
            self._bar.set_postfix_str(f"{complete:.0%} of the steps in order")
            steps.clear()


def train(numbers: Hyperparameters, seed: int) -> Policy:
    """Train from scratch; one seed gives one policy on one machine."""
    torch.set_num_threads(1)
    last = 1.0 - numbers.begins[-1]
    with progress_bar(numbers.actions, "train", "action") as bar:
        schedule = Schedule(bar, numbers, seed)
        model = learner(
            schedule.envs, numbers, seed, lambda left: min(1.0, 0.1 + 0.9 * left / last)
        )
        model.learn(numbers.actions, callback=schedule)
    about = {"scene": "training.imitation", "seed": seed, "hyperparameters": asdict(numbers)}
    return policy_of(model, schedule.scene, about)


def main() -> None:
    """Train and save."""
    parser = argparse.ArgumentParser(prog="python -m training.imitation", description=__doc__)
    parser.add_argument("--seed", type=int, default=0, help="of all random numbers")
    parser.add_argument("--out", type=Path, default=Path("out/imitation.npz"), help="policy's file")
    parser.add_argument(
        "--set", action="append", default=[], metavar="NAME=VALUE", help="hyperparameter"
    )
    args = parser.parse_args()
    try:
        pairs = (given.partition("=") for given in args.set)
        numbers = override(
            Hyperparameters(), [(name, json.loads(value)) for name, _, value in pairs]
        )
        prepare_file(args.out)
        train(numbers, args.seed).save(args.out)
    except (OSError, ValueError) as error:
        parser.error(str(error))
    print(f"written to {args.out}; its steps in the paper's order:")
    print(f"skate-env evaluate --policy order={args.out} --perturb 0.01 --out out/order")


if __name__ == "__main__":
    main()
