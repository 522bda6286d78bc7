"""SHAC (Xu et al. 2022, arXiv:2204.07137): short-horizon actor-critic through the derivatives.

``python -m training.benchmark train --method shac`` trains with it. Needs the extra ``train``.
"""

import copy
from collections.abc import Sequence
from dataclasses import dataclass
from itertools import pairwise

import gymnasium
import numpy as np
import torch
from numpy.typing import NDArray
from torch import Tensor, nn

from skate_env.environments import IceSkateVectorEnv
from skate_env.torch import step


@dataclass(frozen=True)
class Hyperparameters:
    """Hyperparameters of SHAC."""

    envs: int = 64
    horizon: int = 16
    """Actions through which the return is differentiated."""
    gamma: float = 0.995
    lam: float = 0.95
    """Of the TD(lambda) targets of the critic."""
    rate: float = 1e-3
    """Of the actor, at the start; it falls to zero."""
    critic_rate: float = 2e-3
    critic_epochs: int = 8
    minibatches: int = 4
    averaging: float = 0.2
    """Share of the previous target critic in the next one."""
    noise: float = 0.3
    """Initial standard deviation before the tanh."""
    most: float = 1.0
    """Norm to which the actor's gradient is clipped."""
    adjoint: float = 3.0
    """Norm to which the gradient by the state of each environment is clipped at every action."""
    episode: int = 1000


class Moments:
    """Running mean and variance of observations."""

    def __init__(self, size: int) -> None:
        self.mean, self.var, self.count = torch.zeros(size), torch.ones(size), 1e-4

    def update(self, rows: Tensor) -> None:
        """Add rows (k, size)."""
        mean, var, k = rows.mean(0), rows.var(0, unbiased=False), len(rows)
        total, off = self.count + k, mean - self.mean
        self.var = (self.var * self.count + var * k + off**2 * self.count * k / total) / total
        self.mean, self.count = self.mean + off * k / total, total

    def __call__(self, rows: Tensor) -> Tensor:
        """Normalise and clip."""
        return ((rows - self.mean) / (self.var + 1e-5).sqrt()).clamp(-10.0, 10.0)


def network(sizes: tuple[int, ...], last: float) -> nn.Sequential:
    """Layers with ELU and normalisation; weights of the last one are multiplied by ``last``."""
    layers: list[nn.Module] = []
    for inputs, outputs in pairwise(sizes[:-1]):
        layers += [nn.Linear(inputs, outputs), nn.ELU(), nn.LayerNorm(outputs)]
    output = nn.Linear(sizes[-2], sizes[-1])
    with torch.no_grad():
        output.weight *= last
    return nn.Sequential(*layers, output)


class Shac:
    """Actor, critic, and the environments that they learn in."""

    def __init__(self, env_id: str, seed: int, numbers: Hyperparameters, total: int) -> None:
        torch.manual_seed(seed)
        self.numbers, self.total, self.actions = numbers, total, 0
        envs = gymnasium.make_vec(env_id, num_envs=numbers.envs, max_episode_steps=numbers.episode)
        assert isinstance(envs, IceSkateVectorEnv)
        self.envs = envs
        # Episodes end at different times.
        elapsed = np.linspace(0, numbers.episode - 1, numbers.envs).astype(int)
        observations, _ = envs.reset(seed=seed, options={"elapsed": elapsed})
        self.observations = torch.as_tensor(observations)
        self.over = torch.zeros(numbers.envs, dtype=torch.bool)
        size, joints = observations.shape[1], len(envs.joint_names)
        self.moments = Moments(size)
        self.actor = network((size, 64, 64, joints), 0.01)
        self.log_std = nn.Parameter(torch.full((joints,), float(np.log(numbers.noise))))
        self.critic = network((size, 64, 64, 1), 1.0)
        self.target = copy.deepcopy(self.critic)
        parameters = [*self.actor.parameters(), self.log_std]
        self.optimiser = torch.optim.Adam(parameters, numbers.rate, (0.7, 0.95))
        self.critic_optimiser = torch.optim.Adam(
            self.critic.parameters(), numbers.critic_rate, (0.7, 0.95)
        )

    def act(self, observations: NDArray[np.float32]) -> NDArray[np.float32]:
        """Actions without noise."""
        with torch.no_grad():
            means = self.actor(self.moments(torch.as_tensor(observations)))
            actions: NDArray[np.float32] = torch.tanh(means).numpy()
        return actions

    def update(self) -> None:
        """Make one rollout; improve the actor by its gradient, then the critic."""
        numbers = self.numbers
        loss, discount = torch.zeros(()), torch.ones(numbers.envs)
        states = torch.as_tensor(self.envs.state_vectors())
        observations = self.observations
        rows: list[tuple[Tensor, ...]] = []
        for k in range(numbers.horizon):
            seen = self.moments(observations)
            noise = self.log_std.exp() * torch.randn(numbers.envs, len(self.log_std))
            action = torch.tanh(self.actor(seen) + noise)
            following, reward, states, ended, cut = step(self.envs, action, states)
            if k + 1 < numbers.horizon:
                states.register_hook(self.limited)
            # After an episode's end a step resets; it has neither reward nor gradient.
            counts = ~self.over
            loss = loss - (discount * reward * counts).sum()
            value = self.target(self.moments(following)).squeeze(1)
            over = (ended | cut) & counts
            last = over | torch.full_like(over, k == numbers.horizon - 1)
            loss = loss - (numbers.gamma * discount * value * (last & ~ended & counts)).sum()
            discount = torch.where(over | ~counts, 1.0, numbers.gamma * discount)
            rows.append((seen.detach(), reward.detach(), value.detach(), ended, over, counts))
            observations, self.over = following, over
        self.optimiser.param_groups[0]["lr"] = numbers.rate * max(
            0.0, 1.0 - self.actions / self.total
        )
        self.optimiser.zero_grad()
        torch.autograd.backward(loss / (numbers.envs * numbers.horizon))
        norm = nn.utils.clip_grad_norm_([*self.actor.parameters(), self.log_std], numbers.most)
        if torch.isfinite(norm):
            self.optimiser.step()
        self.observations = observations.detach()
        self.actions += numbers.envs * numbers.horizon
        self.improve_critic(rows)

    def limited(self, gradient: Tensor) -> Tensor:
        """Clip the gradient by the states, environment by environment."""
        most = self.numbers.adjoint / (self.numbers.envs * self.numbers.horizon)
        norm = gradient.norm(dim=1, keepdim=True)
        scale: Tensor = (most / norm.clamp(min=1e-12)).clamp(max=1.0)
        return gradient.mul(scale)

    def improve_critic(self, rows: Sequence[tuple[Tensor, ...]]) -> None:
        """Fit the critic to TD(lambda) targets of the target critic."""
        numbers, targets = self.numbers, []
        following = torch.zeros(numbers.envs)
        for k, (_, reward, value, ended, over, _) in reversed(list(enumerate(rows))):
            last = over | torch.full_like(over, k == len(rows) - 1)
            mixed = torch.where(last, value, (1 - numbers.lam) * value + numbers.lam * following)
            following = reward + numbers.gamma * mixed * ~ended
            targets.append(following)
        counts = torch.cat([row[5] for row in rows])
        seen = torch.cat([row[0] for row in rows])[counts]
        target = torch.cat(targets[::-1])[counts]
        for _ in range(numbers.critic_epochs):
            for part in torch.randperm(len(seen)).chunk(numbers.minibatches):
                error = self.critic(seen[part]).squeeze(1) - target[part]
                self.critic_optimiser.zero_grad()
                (error**2).mean().backward()
                nn.utils.clip_grad_norm_(self.critic.parameters(), 1.0)
                self.critic_optimiser.step()
        with torch.no_grad():
            for old, new in zip(self.target.parameters(), self.critic.parameters(), strict=True):
                old.lerp_(new, 1.0 - numbers.averaging)
        self.moments.update(seen * (self.moments.var + 1e-5).sqrt() + self.moments.mean)
