"""Linear feedback about an orbit by the periodic Riccati equation, as an `OrbitPolicy`.

An action holds its torques over h samples of the controller. Phase j of the cycle of N samples is
followed by phase j + h modulo N; so the recursion

    S_j = Q + A_j' S_{j+h} (A_j - B_j K_j),   K_j = (R + B_j' S_{j+h} B_j)^-1 B_j' S_{j+h} A_j

runs over all phases, also if the action is no part of the period (Bittanti, Colaneri and De Nicolao
1991). A_j and B_j are those of `Simulator.linearize`, through all events. An orbit with residual
torques has phases at the starts of its actions only.
"""

import math
from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from skate_env import Scene
from skate_env.environments import IceSkateEnv, joints
from skate_env.policies import OrbitPolicy, inputs
from skate_env.scenes import Mirror, replace

from .close import Orbit

Array = NDArray[np.float64]

# Weights of angles [1/rad^2] and velocities [s^2/rad^2, s^2/m^2].
ANGLE, RATE = 1.0, 0.01
# Sweeps over all phases, and the relative change at which they end.
_SWEEPS, _CONVERGED = 60, 1e-6
# The policy has a phase every so many samples of an orbit without residual torques.
_STRIDE = 2
# Longest cycle [gait steps].
_MOST_STEPS = 2
# Number of coordinates of the root; contact states of one flat foot.
_ROOT, _FLAT = 3, (1, 3)


@dataclass(frozen=True)
class _Cycle:
    """Linearizations of an action from each of m phases, in states of the engine (s,).

    Attributes
    ----------
    after
        Number of phases that an action takes.
    A, B
        (m, s, s) and (m, s, joints): to the phase after the action, mirrored if the cycle ends in
        between; torques in parts of a full action.
    onto
        Projectors onto the tangent space without translation (m, s, s).
    left
        Whether the left leg supports (m,).
    flat
        Whether one foot is flat on the ice, and the other in the air (m,).
    actions
        Of the orbit, in parts of a full action (m, joints).
    states
        q and v (m, 2 n).
    observations
        (m, d).
    """

    after: int
    A: Array
    B: Array
    onto: Array
    left: NDArray[np.bool_]
    flat: NDArray[np.bool_]
    actions: Array
    states: Array
    observations: Array


def design(
    orbit: Orbit,
    scale: Mapping[str, float],
    *,
    weight: float = 1.0,
    limit: float = 1e9,
    after_swap: bool = False,
) -> OrbitPolicy:
    """Design the feedback about an orbit.

    Parameters
    ----------
    orbit
        Closed orbit.
    scale
        Residual torque of a full action by joint [N m]; joints that the scene locks do not count.
    weight
        Of the square of a full torque, beside 1 for that of 1 rad.
    limit
        That of `OrbitPolicy`.
    after_swap
        Whether the scene of an orbit with residual torques starts after a swap of the legs instead
        of in the middle of the time on one flat foot. There t_0 of a start is that of the orbit.

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
    scale = {name: scale[name] for name in names}
    cycle = _cycle(orbit, np.array(list(scale.values())))
    S, K = _riccati(cycle, n, weight)
    # The policy sees no height of the foot and no memory.
    seen = [*range(2, n), *range(n, 2 * n)]
    env = IceSkateEnv(scene, joints="all", mirrored=False)
    mirror, of_joints = Mirror(env.observation_names), Mirror(names)
    left = cycle.left
    observed = np.where(left[:, None], mirror(cycle.observations), cycle.observations)
    flip = strobe.mirror[np.ix_(seen, seen)]
    gains, actions = K[:, :, seen], cycle.actions
    gains[left] = of_joints((gains[left] @ flip).swapaxes(1, 2)).swapaxes(1, 2)
    actions[left] = of_joints(actions[left])
    costs = S[:, seen][:, :, seen]
    costs[left] = flip @ costs[left] @ flip
    sizes, vectors = np.linalg.eigh(costs)
    roots = np.sqrt(sizes.clip(0.0))[:, :, None] * vectors.swapaxes(1, 2)
    stride = _STRIDE
    if start.torques is not None:
        scene, stride = _begun(orbit, cycle, after_swap), 1
    return OrbitPolicy(
        scene=scene,
        references=observed[::stride, inputs(env.observation_names)],
        actions=actions[::stride].astype(np.float32),
        gains=gains[::stride].astype(np.float32),
        roots=roots[::stride].astype(np.float32),
        limit=limit,
        action_scale=scale,
        observation_names=env.observation_names,
        joint_names=names,
        about={
            "weights": {"angle": ANGLE, "rate": RATE, "torque": weight},
            "samples": start.samples,
            "sample_period": start.period,
            "period": start.duration,
        },
    )


def _begun(orbit: Orbit, cycle: _Cycle, after_swap: bool) -> Scene:
    """Return the scene with its start on the orbit, see `design`.

    A scene starts on the whole right sole, with the other foot in the air.
    """
    n, names = orbit.strobe.n, orbit.strobe.sim.coordinate_names
    flat = np.flatnonzero(cycle.flat)
    if not len(flat):
        raise ValueError(
            "no start: on the orbit no foot is flat on the ice with the other in the air"
        )
    place = flat[0 if after_swap else len(flat) // 2]
    state = cycle.states[place]
    if cycle.left[place]:
        state = orbit.strobe.mirror[: 2 * n, : 2 * n] @ state
    q, v = np.split(state, 2)
    changes = {f"start.q.{name}": q[i] for i, name in enumerate(names) if i >= _ROOT}
    changes |= {f"start.v.{name}": v[i] for i, name in enumerate(names) if i == 0 or i >= _ROOT}
    return replace(orbit.strobe.scene, changes)


def _cycle(orbit: Orbit, scale: Array) -> _Cycle:
    """Linearize an action from each phase, on the second cycle of the orbit.

    On the first one the time since the last event is not that of the orbit.
    """
    strobe, start = orbit.strobe, orbit.start
    sim, first = strobe.sim, start.tick + start.samples
    action = round(sim.action_period / strobe.period)
    spacing = 1 if start.torques is None else action
    ticks = range(0, start.samples, spacing)
    sim.restore(start.snapshot)
    number, size = len(ticks), len(strobe.mirror)
    A, onto = np.empty((2, number, size, size))
    B = np.empty((number, size, len(scale)))
    left, flat, actions, states, observations = [], [], [], [], []
    for phase, tick in enumerate(ticks):
        strobe.advance(start, (first + tick) * start.period)
        left.append(sim.support_leg == "left")
        flat.append(sim.state_number in _FLAT)
        states.append(np.concatenate([sim.q, sim.v]))
        observations.append(sim.observation())
        torque = strobe.torque(start)
        actions.append(np.zeros_like(scale) if torque is None else _parts(torque, scale))
        here = sim.snapshot()
        lin = strobe.linearize(start, (first + tick + action) * start.period)
        sim.restore(here)
        # Coordinates of the phase after the action: those of the same cycle.
        back = strobe.back(start.steps) if tick + action >= start.samples else np.eye(size)
        A[phase] = back @ strobe.reduction @ lin.A
        B[phase] = back @ strobe.reduction @ lin.B * scale
        basis = strobe.basis(lin.tangent_before, [])
        onto[phase] = basis @ basis.T
    return _Cycle(
        action // spacing,
        A,
        B,
        onto,
        np.array(left),
        np.array(flat),
        np.array(actions),
        np.array(states),
        np.array(observations, np.float64),
    )


def _parts(torque: Array, scale: Array) -> Array:
    """Return a torque in parts of a full action; zero in joints without one."""
    return np.divide(torque, scale, out=np.zeros_like(torque), where=scale > 0.0)


def _riccati(cycle: _Cycle, n: int, weight: float) -> tuple[Array, Array]:
    """Return costs-to-go S (m, s, s) and gains K (m, joints, s)."""
    number, size, width = cycle.B.shape
    weights = np.zeros(size)
    weights[1:n], weights[n : 2 * n] = ANGLE, RATE
    Q, R = np.diag(weights), weight * np.eye(width)
    S, K = np.broadcast_to(Q, (number, size, size)).copy(), np.zeros((number, width, size))
    chains = math.gcd(cycle.after, number)
    for _ in range(_SWEEPS):
        change = 0.0
        for chain in range(chains):
            for i in reversed(range(number // chains)):
                j = (chain + i * cycle.after) % number
                A, B, onto = cycle.A[j], cycle.B[j], cycle.onto[j]
                after = S[(j + cycle.after) % number]
                K[j] = np.linalg.solve(R + B.T @ after @ B, B.T @ after @ A) @ onto
                new = onto @ (Q + A.T @ after @ (A - B @ K[j])) @ onto
                new = 0.5 * (new + new.T)
                change = max(change, np.abs(new - S[j]).max() / np.abs(new).max())
                S[j] = new
        if change < _CONVERGED:
            break
    return S, K
