"""Differentiable rollouts and environments for PyTorch, which must be installed."""

from typing import Any

import torch
from numpy.typing import NDArray

from . import gradients
from ._core import Simulator
from .environments import IceSkateVectorEnv


def _numbers(tensor: torch.Tensor) -> NDArray[Any]:
    """Return the values of a tensor in double precision."""
    numbers: NDArray[Any] = tensor.detach().cpu().double().numpy()
    return numbers


def _check_floating(name: str, given: object) -> None:
    """Check the type of an argument: results have the type of the tensors, gradients as well."""
    if not isinstance(given, torch.Tensor):
        raise TypeError(f"{name}: must be a tensor, not {type(given).__name__}")
    if not given.is_floating_point():
        raise TypeError(f"{name} has dtype {given.dtype}: must be a floating-point tensor")


class _FirstDerivative(torch.autograd.Function):
    """A gradient whose own derivative is an error; autograd would take it for zero."""

    @staticmethod
    def forward(_: Any, gradient: torch.Tensor, *by: torch.Tensor | None) -> torch.Tensor:
        return gradient.clone()

    @staticmethod
    def backward(_: Any, *weights: torch.Tensor) -> Any:
        raise RuntimeError("skate_env.torch has first derivatives only, no second ones")


class _Rollout(torch.autograd.Function):
    @staticmethod
    def forward(
        ctx: Any, start: torch.Tensor | None, torques: torch.Tensor, sim: Simulator
    ) -> torch.Tensor:
        # Not saved for the backward pass, which does not use the values: they may change in place.
        ctx.inputs = start, torques
        begin = None if start is None else _numbers(start)
        ctx.done = gradients.rollout(sim, _numbers(torques), begin)
        return torch.as_tensor(ctx.done.states, dtype=torques.dtype, device=torques.device)

    @staticmethod
    def backward(ctx: Any, weights: torch.Tensor) -> tuple[torch.Tensor | None, torch.Tensor, None]:
        start, torques = (
            _FirstDerivative.apply(torch.as_tensor(part).to(weights), *ctx.inputs, weights)
            for part in ctx.done.vjp(_numbers(weights))
        )
        return start if ctx.needs_input_grad[0] else None, torques, None


def rollout(
    sim: Simulator, torques: torch.Tensor, start: torch.Tensor | None = None
) -> torch.Tensor:
    """States (T + 1, s) of T actions with held torques (T, m) [N m]; the simulator moves on.

    Gradients by the torques, and by the state ``start`` (s,), see `Simulator.state_vector`; None
    for the simulator's own. A start off the constraints is projected first.

    Raises
    ------
    TypeError, ValueError
        As `gradients.rollout` does; TypeError also for what is no floating-point tensor.
    """
    _check_floating("torques", torques)
    if start is not None:
        _check_floating("start", start)
    states: torch.Tensor = _Rollout.apply(start, torques, sim)
    return states


class _Step(torch.autograd.Function):
    @staticmethod
    def forward(
        ctx: Any, actions: torch.Tensor, states: torch.Tensor, envs: IceSkateVectorEnv
    ) -> tuple[torch.Tensor, ...]:
        ctx.inputs = actions, states
        *results, ctx.derivatives = envs.advance_differentiated(_numbers(actions))
        observations, rewards = (torch.as_tensor(x).to(actions) for x in results[:2])
        ended = [torch.as_tensor(x, device=actions.device) for x in results[2:]]
        ctx.mark_non_differentiable(*ended)
        return observations, rewards, torch.as_tensor(envs.state_vectors()).to(states), *ended

    @staticmethod
    def backward(
        ctx: Any, observations: torch.Tensor, rewards: torch.Tensor, states: torch.Tensor, *_: Any
    ) -> tuple[torch.Tensor, torch.Tensor, None]:
        weights = (observations, rewards, states)
        by_state, by_action = ctx.derivatives.vjp(*map(_numbers, weights))
        return (
            _FirstDerivative.apply(torch.as_tensor(by_action).to(rewards), *ctx.inputs, *weights),
            _FirstDerivative.apply(torch.as_tensor(by_state).to(states), *ctx.inputs, *weights),
            None,
        )


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
        As `IceSkateVectorEnv.advance_differentiated` does; TypeError also for what is no
        floating-point tensor, ValueError for ``states`` of another shape. No environment has moved.
    """
    _check_floating("actions", actions)
    _check_floating("states", states)
    wanted = envs.state_vectors().shape
    if states.shape != wanted:
        raise ValueError(f"states has shape {tuple(states.shape)}: must be {wanted}")
    results: tuple[torch.Tensor, ...] = _Step.apply(actions, states, envs)
    observations, rewards, after, terminated, truncated = results
    return observations, rewards, after, terminated, truncated
