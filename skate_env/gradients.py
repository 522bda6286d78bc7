"""Derivatives of a sequence of actions, and of the steps of environments."""

import copy
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray

from ._core import Simulator
from .common import checked

_Array = NDArray[np.float64]


@dataclass(frozen=True)
class Rollout:
    """A motion of T actions with the derivatives of each, from `rollout`.

    The state has s entries, see `Simulator.state_vector`; an action has m torques.
    """

    states: _Array
    """State before the first and after every action (T + 1, s)."""
    A: _Array
    """State after an action by the state before it (T, s, s)."""
    B: _Array
    """State after an action by its torques (T, s, m)."""
    nonsmooth: Sequence[tuple[int, str, float, float]]
    """Action, reason, time [s] and margin where a derivative may not exist."""

    def jvp(self, dx: ArrayLike | None = None, du: ArrayLike | None = None) -> _Array:
        """Variation of the states (T + 1, s) by those of the start (s,) and the torques (T, m).

        Raises
        ------
        TypeError, ValueError
            If they are not finite real numbers of these shapes.
        """
        actions, size, joints = self.B.shape
        start = np.zeros(size) if dx is None else checked("dx", dx, (size,))
        torques = np.zeros((actions, joints))
        if du is not None:
            torques = checked("du", du, (actions, joints))
        states = np.empty((actions + 1, size))
        states[0] = start
        for k in range(actions):
            states[k + 1] = self.A[k] @ states[k] + self.B[k] @ torques[k]
        return states

    def vjp(self, weights: ArrayLike) -> tuple[_Array, _Array]:
        """Gradient of sum(weights * states) by the start (s,) and by the torques (T, m).

        Raises
        ------
        TypeError, ValueError
            If the weights are not finite real numbers of the states' shape.
        """
        actions, size, joints = self.B.shape
        given = checked("weights", weights, (actions + 1, size))
        torques = np.empty((actions, joints))
        gradient = given[actions].copy()
        for k in reversed(range(actions)):
            torques[k] = gradient @ self.B[k]
            gradient = gradient @ self.A[k] + given[k]
        return gradient, torques


def rollout(sim: Simulator, torques: ArrayLike, start: ArrayLike | None = None) -> Rollout:
    """Make actions with held torques (T, m) [N m], and differentiate; the simulator moves on.

    ``start`` is the state (s,) before the first action, see `Simulator.displace`; None for the
    simulator's own.

    Raises
    ------
    TypeError
        If the first argument is no simulator, or torques or start are not real numbers.
    ValueError
        If torques or start have another shape or are not finite, the motion terminates, or the
        accuracy of the scene has no derivatives; see `Simulator.linearize`. The simulator is
        unchanged.
    """
    if not isinstance(sim, Simulator):
        raise TypeError(f"sim: must be a Simulator, not {type(sim).__name__}")
    present = sim.state_vector()
    size, joints = len(present), len(sim.q) - 3
    given = checked("torques", torques, ("T", joints))
    change = np.zeros(size) if start is None else checked("start", start, (size,)) - present
    # A later action may have no derivatives: the simulator itself moves at the end.
    done = _differentiated(copy.copy(sim), given, change)
    _displace(sim, change)
    for torque in given:
        sim.step(torque)
    return done


def _differentiated(sim: Simulator, torques: _Array, change: _Array) -> Rollout:
    """Make a `rollout` with a simulator that may stop in the middle."""
    _displace(sim, change)
    actions, joints = torques.shape
    size = len(change)
    states = np.empty((actions + 1, size))
    A = np.empty((actions, size, size))
    B = np.empty((actions, size, joints))
    nonsmooth = []
    states[0] = sim.state_vector()
    for k, torque in enumerate(torques):
        lin = sim.linearize(torque)
        sim.step(torque)
        states[k + 1], A[k], B[k] = sim.state_vector(), lin.A, lin.B
        nonsmooth += [(k, *reason) for reason in lin.nonsmooth]
    return Rollout(states, A, B, nonsmooth)


def _displace(sim: Simulator, change: _Array) -> None:
    if change.any():
        sim.displace(change)


@dataclass(frozen=True)
class StepDerivatives:
    """Derivatives of a step of n environments, from `IceSkateVectorEnv.advance_differentiated`.

    The state has z entries, see `IceSkateVectorEnv.state_vectors`; an action has m entries. All are
    zero where `exists` is false.
    """

    A: _Array
    """State after the step by the state before it (n, z, z)."""
    B: _Array
    """State after the step by the action (n, z, m); zero for a clipped entry."""
    reward_state: _Array
    """Reward by the state before the step (n, z)."""
    reward_action: _Array
    """Reward by the action (n, m)."""
    observation: _Array
    """Observation of d entries by the state after the step (n, d, z); zero for a clipped entry."""
    exists: NDArray[np.bool_]
    """Environments (n,) that have made an action without a fall or another termination."""
    nonsmooth: Sequence[tuple[int, str, float, float]]
    """Environment, reason, time [s] and margin where a derivative may not exist."""

    def vjp(
        self, observations: ArrayLike, rewards: ArrayLike, states: ArrayLike
    ) -> tuple[_Array, _Array]:
        """Gradient of a weighted sum of the results of the step.

        Parameters
        ----------
        observations, rewards, states
            Weights (n, d), (n,) and (n, z) of observations, rewards and states after the step.

        Returns
        -------
        by_state, by_action
            (n, z) and (n, m).

        Raises
        ------
        TypeError, ValueError
            If the weights are not finite real numbers of these shapes.
        """
        n, size, _ = self.B.shape
        seen = checked("observations", observations, (n, self.observation.shape[1]))
        earned = checked("rewards", rewards, (n,))[:, None]
        after = checked("states", states, (n, size)) + np.einsum(
            "nd,ndz->nz", seen, self.observation
        )
        by_state = np.einsum("nz,nzy->ny", after, self.A) + earned * self.reward_state
        by_action = np.einsum("nz,nzm->nm", after, self.B) + earned * self.reward_action
        return by_state, by_action
