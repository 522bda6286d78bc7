"""Differentiable rollouts and environments for PyTorch, which must be installed."""

from typing import Any

import numpy as np
import torch

from . import gradients
from ._core import Simulator
from .vector import IceSkateVectorEnv


class _Rollout(torch.autograd.Function):
    @staticmethod
    def forward(
        ctx: Any, start: torch.Tensor, torques: torch.Tensor, sim: Simulator
    ) -> torch.Tensor:
        change = start.detach().cpu().double().numpy() - sim.state_vector()
        if change.any():
            sim.displace(change)
        ctx.done = gradients.rollout(sim, torques.detach().cpu().double().numpy())
        return torch.as_tensor(ctx.done.states, dtype=torques.dtype, device=torques.device)

    @staticmethod
    def backward(ctx: Any, weights: torch.Tensor) -> tuple[torch.Tensor, torch.Tensor, None]:
        given = np.asarray(weights.detach().cpu().double().numpy())
        start, torques = (torch.as_tensor(part).to(weights) for part in ctx.done.vjp(given))
        return start, torques, None


def rollout(
    sim: Simulator, torques: torch.Tensor, start: torch.Tensor | None = None
) -> torch.Tensor:
    """States (T + 1, s) of T actions with held torques (T, m) [N m]; the simulator moves on.

    Gradients by the torques, and by the state ``start`` (s,), see `Simulator.state_vector`; None
    for the simulator's own. A start off the constraints is projected first.

    Raises
    ------
    ValueError
        As `gradients.rollout` does.
    """
    if start is None:
        start = torch.as_tensor(sim.state_vector(), dtype=torques.dtype, device=torques.device)
    states: torch.Tensor = _Rollout.apply(start, torques, sim)
    return states


class _Step(torch.autograd.Function):
    @staticmethod
    def forward(
        ctx: Any, actions: torch.Tensor, states: torch.Tensor, envs: IceSkateVectorEnv
    ) -> tuple[torch.Tensor, ...]:
        given = actions.detach().cpu().double().numpy()
        *results, ctx.derivatives = envs.advance_differentiated(given)
        observations, rewards = (torch.as_tensor(x).to(actions) for x in results[:2])
        ended = [torch.as_tensor(x, device=actions.device) for x in results[2:]]
        ctx.mark_non_differentiable(*ended)
        return observations, rewards, torch.as_tensor(envs.state_vectors()).to(states), *ended

    @staticmethod
    def backward(
        ctx: Any, observations: torch.Tensor, rewards: torch.Tensor, states: torch.Tensor, *_: Any
    ) -> tuple[torch.Tensor, torch.Tensor, None]:
        weights = (part.detach().cpu().double().numpy() for part in (observations, rewards, states))
        by_state, by_action = ctx.derivatives.vjp(*weights)
        return torch.as_tensor(by_action).to(rewards), torch.as_tensor(by_state).to(states), None


def step(
    envs: IceSkateVectorEnv, actions: torch.Tensor, states: torch.Tensor
) -> tuple[torch.Tensor, torch.Tensor, torch.Tensor, torch.Tensor, torch.Tensor]:
    """Step environments with gradients by actions (n, m) and states (n, z).

    ``states`` carries the gradient from step to step: at first
    ``torch.as_tensor(envs.state_vectors())``, later the third result; ``states.detach()`` cuts it.
    Its values are not read. Where an environment has no derivatives, no gradient passes.

    Returns
    -------
    observations, rewards, states, terminated, truncated
        (n, d), (n,), (n, z), (n,) and (n,) of bool.

    Raises
    ------
    TypeError, ValueError, ResetNeeded
        As `IceSkateVectorEnv.advance_differentiated` does.
    """
    results: tuple[torch.Tensor, ...] = _Step.apply(actions, states, envs)
    observations, rewards, after, terminated, truncated = results
    return observations, rewards, after, terminated, truncated
