"""Linear feedback about an orbit by the periodic Riccati equation, as an `OrbitPolicy`.

An action holds its torques over h samples of the controller. Phase j of the cycle of N samples is
followed by phase j + h modulo N; so the recursion

    S_j = Q + A_j' S_{j+h} (A_j - B_j K_j),   K_j = (R + B_j' S_{j+h} B_j)^-1 B_j' S_{j+h} A_j

runs over all phases, also if the action is no part of the period (Bittanti, Colaneri and De Nicolao
1991). A_j and B_j are those of `Simulator.linearize`, through all events.
"""

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from ...env import IceSkateEnv
from ...env_config import TORQUE_SCALE, joints
from ...mirror import Mirror
from ...orbit_policy import OrbitPolicy, inputs
from .close import Orbit

Array = NDArray[np.float64]

# Weights of angles [1/rad^2], velocities [s^2/rad^2, s^2/m^2], and of a full torque.
ANGLE, RATE, TORQUE = 1.0, 0.01, 1.0
# Sweeps over all phases, and the relative change at which they end.
_SWEEPS, _CONVERGED = 60, 1e-6
# The policy has a phase every so many samples.
_STRIDE = 2
# Longest cycle [gait steps].
_MOST_STEPS = 2


@dataclass(frozen=True)
class _Cycle:
    """Linearizations of an action from each of N phases, in states of the engine (s,).

    Attributes
    ----------
    A, B
        (N, s, s) and (N, s, joints): to the phase after the action, mirrored if the cycle ends in
        between; torques in parts of a full action.
    onto
        Projectors onto the tangent space without translation (N, s, s).
    left
        Whether the left leg supports (N,).
    contact_states
        (N,).
    observations
        (N, d).
    """

    A: Array
    B: Array
    onto: Array
    left: NDArray[np.bool_]
    contact_states: NDArray[np.int64]
    observations: Array


def design(orbit: Orbit, limit: float) -> OrbitPolicy:
    """Design the feedback about an orbit; ``limit`` is that of `OrbitPolicy`.

    Raises
    ------
    ValueError
        If the cycle has more than two gait steps, or the motion ends within an action from it.
    """
    strobe, start = orbit.strobe, orbit.start
    scene, n = strobe.scene, strobe.n
    if start.steps > _MOST_STEPS:
        raise ValueError(f"no feedback about a cycle of {start.steps} gait steps")
    names = joints(scene)
    scale = {name: TORQUE_SCALE[name] for name in names}
    cycle = _cycle(orbit, np.array(list(scale.values())))
    S, K = _riccati(cycle, n, round(strobe.sim.action_period / strobe.period))
    # The policy sees no height of the foot and no memory.
    seen = [*range(2, n), *range(n, 2 * n)]
    env = IceSkateEnv(scene, joints="all", mirrored=False)
    mirror, of_joints = Mirror(env.observation_names), Mirror(names)
    entries = inputs(env.observation_names)
    left = cycle.left
    observed = np.where(left[:, None], mirror(cycle.observations), cycle.observations)[:, entries]
    flip = strobe.mirror[np.ix_(seen, seen)]
    gains = K[:, :, seen]
    gains[left] = of_joints((gains[left] @ flip).swapaxes(1, 2)).swapaxes(1, 2)
    costs = S[:, seen][:, :, seen]
    costs[left] = flip @ costs[left] @ flip
    sizes, vectors = np.linalg.eigh(costs)
    roots = np.sqrt(sizes.clip(0.0))[:, :, None] * vectors.swapaxes(1, 2)
    order = np.argsort(cycle.contact_states[::_STRIDE], kind="stable") * _STRIDE
    return OrbitPolicy(
        scene=scene,
        contact_states=cycle.contact_states[order],
        references=observed[order],
        gains=gains[order].astype(np.float32),
        roots=roots[order].astype(np.float32),
        limit=limit,
        action_scale=scale,
        observation_names=env.observation_names,
        joint_names=names,
        about={
            "weights": {"angle": ANGLE, "rate": RATE, "torque": TORQUE},
            "samples": start.samples,
            "sample_period": start.period,
            "period": start.duration,
        },
    )


def _cycle(orbit: Orbit, scale: Array) -> _Cycle:
    """Linearize an action from each phase, on the second cycle of the orbit.

    On the first one the time since the last event is not that of the orbit.
    """
    strobe, start = orbit.strobe, orbit.start
    sim, first = strobe.sim, start.tick + start.samples
    action = round(sim.action_period / strobe.period)
    sim.restore(start.snapshot)
    sim.advance(first * start.period)
    size, number = len(strobe.mirror), start.samples
    A, onto = np.empty((2, number, size, size))
    B = np.empty((number, size, len(scale)))
    left, contacts, observations = [], [], []
    for phase in range(number):
        if phase:
            sim.advance((first + phase) * start.period)
        until = (first + phase + action) * start.period
        lin = sim.linearize(until=until)
        # Coordinates of the phase after the action: those of the same cycle.
        back = strobe.back(start.steps) if phase + action >= number else np.eye(size)
        A[phase] = back @ strobe.reduction @ lin.A
        B[phase] = back @ strobe.reduction @ lin.B * scale
        basis = strobe.basis(lin.tangent_before, [])
        onto[phase] = basis @ basis.T
        left.append(sim.support_leg == "left")
        contacts.append(sim.state_number)
        observations.append(sim.observation())
    return _Cycle(
        A, B, onto, np.array(left), np.array(contacts), np.array(observations, np.float64)
    )


def _riccati(cycle: _Cycle, n: int, action: int) -> tuple[Array, Array]:
    """Return costs-to-go S (N, s, s) and gains K (N, joints, s)."""
    number, size, width = cycle.B.shape
    weights = np.zeros(size)
    weights[1:n], weights[n : 2 * n] = ANGLE, RATE
    Q, R = np.diag(weights), TORQUE * np.eye(width)
    S, K = np.broadcast_to(Q, (number, size, size)).copy(), np.zeros((number, width, size))
    chains = math.gcd(action, number)
    for _ in range(_SWEEPS):
        change = 0.0
        for chain in range(chains):
            for i in reversed(range(number // chains)):
                j = (chain + i * action) % number
                A, B, onto, after = cycle.A[j], cycle.B[j], cycle.onto[j], S[(j + action) % number]
                K[j] = np.linalg.solve(R + B.T @ after @ B, B.T @ after @ A) @ onto
                new = onto @ (Q + A.T @ after @ (A - B @ K[j])) @ onto
                new = 0.5 * (new + new.T)
                change = max(change, np.abs(new - S[j]).max() / np.abs(new).max())
                S[j] = new
        if change < _CONVERGED:
            break
    return S, K
