"""Derivatives of a sequence of actions, and of the steps of environments."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray

from ._core import Simulator

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
        """Variation of the states (T + 1, s) by those of the start (s,) and the torques (T, m)."""
        actions, size, joints = self.B.shape
        start = _given("dx", dx, (size,))
        torques = _given("du", du, (actions, joints))
        states = np.empty((actions + 1, size))
        states[0] = start
        for k in range(actions):
            states[k + 1] = self.A[k] @ states[k] + self.B[k] @ torques[k]
        return states

    def vjp(self, weights: ArrayLike) -> tuple[_Array, _Array]:
        """Gradient of sum(weights * states) by the start (s,) and by the torques (T, m)."""
        actions, size, joints = self.B.shape
        given = _given("weights", weights, (actions + 1, size))
        torques = np.empty((actions, joints))
        gradient = given[actions].copy()
        for k in reversed(range(actions)):
            torques[k] = gradient @ self.B[k]
            gradient = gradient @ self.A[k] + given[k]
        return gradient, torques


def rollout(sim: Simulator, torques: ArrayLike) -> Rollout:
    """Make actions with held torques (T, m) [N m], and differentiate; the simulator moves on.

    Raises
    ------
    TypeError
        If the first argument is no simulator.
    ValueError
        If the torques have another shape, the motion terminates, or the accuracy of the scene has
        no derivatives; see `Simulator.linearize`.
    """
    if not isinstance(sim, Simulator):
        raise TypeError(f"sim: must be a Simulator, not {type(sim).__name__}")
    n = len(sim.q)
    given = np.asarray(torques, dtype=float)
    if given.ndim != 2 or given.shape[1] != n - 3:
        raise ValueError(f"torques: shape {given.shape}, not (actions, {n - 3})")
    size = len(sim.state_vector())
    states = np.empty((len(given) + 1, size))
    A = np.empty((len(given), size, size))
    B = np.empty((len(given), size, n - 3))
    nonsmooth = []
    states[0] = sim.state_vector()
    for k, torque in enumerate(given):
        lin = sim.linearize(torque)
        sim.step(torque)
        states[k + 1], A[k], B[k] = sim.state_vector(), lin.A, lin.B
        nonsmooth += [(k, *reason) for reason in lin.nonsmooth]
    return Rollout(states, A, B, nonsmooth)


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
        """
        n, size, _ = self.B.shape
        seen = _given("observations", observations, (n, self.observation.shape[1]))
        earned = _given("rewards", rewards, (n,))[:, None]
        after = _given("states", states, (n, size)) + np.einsum(
            "nd,ndz->nz", seen, self.observation
        )
        by_state = np.einsum("nz,nzy->ny", after, self.A) + earned * self.reward_state
        by_action = np.einsum("nz,nzm->nm", after, self.B) + earned * self.reward_action
        return by_state, by_action


def _given(name: str, values: ArrayLike | None, shape: tuple[int, ...]) -> _Array:
    """Zeros for None; ValueError for another shape."""
    if values is None:
        return np.zeros(shape)
    given = np.asarray(values, dtype=float)
    if given.shape != shape:
        raise ValueError(f"{name}: shape {given.shape}, not {shape}")
    return given
