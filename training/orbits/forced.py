"""Orbits with residual torques, near the motion of a learned policy.

A policy's motion seldom repeats: its observations see the samples' grid. The step that comes
nearest to itself is made periodic. Its residual torques and its start are the unknowns: in each
round the torques change by the solution of a linear-quadratic problem, as little as possible for a
smaller residual, and the start moves to the end of the cycle. The policy's feedback is not part of
the orbit.
"""

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from statistics import mode

import numpy as np
from numpy.typing import NDArray

from skate_env import Scene
from skate_env.policies import OrbitPolicy, Policy

from .close import CLOSED, Orbit
from .linear_quadratic import solve
from .strobe import Start, Strobe

Array = NDArray[np.float64]

# Simulated time, and the number of candidates that are tried.
_SEARCHED, _CANDIDATES = 60.0, 8
# Scale of velocities beside angles in the distance of a step from itself [s].
_VELOCITY = 0.1
# Weights of deviations on the way: angles [1/rad^2], velocities [s^2/rad^2], and of a full torque.
_ON_THE_WAY, _TORQUE = (1.0, 0.003), 0.4
# Weights of the residual in the first round; its factor from round to round.
_AT_THE_END, _FACTOR = (10.0, 0.1), 10.0
# Largest number of rounds, residual at which they end, and parts of a change that are tried.
_ROUNDS, _AIM, _PARTS = 14, 1e-11, (1.0, 0.5, 0.2)


@dataclass(frozen=True)
class _Run:
    """A cycle.

    Attributes
    ----------
    states
        Relative states before the actions (k, s).
    torques
        Residual torques (k, joints) [N m].
    residual
        End, mirrored back, minus start (s,); infinite after a fall, and if the legs do not swap in
        the last action.
    """

    states: Array
    torques: Array
    residual: Array


class _Cycle:
    """A cycle of a policy's motion whose start and torques change.

    Parameters
    ----------
    strobe, start
        The cycle, with torques.
    scale
        Largest residual torque of each joint (joints,) [N m].
    """

    def __init__(self, strobe: Strobe, start: Start, scale: Array) -> None:
        self._start, self._strobe, self._scale = start, strobe, scale
        n, size = strobe.n, len(strobe.mirror)
        self._moving = np.arange(1, 2 * n)
        self._on_the_way, self._at_the_end = np.zeros((2, size))
        self._on_the_way[1:n], self._on_the_way[n : 2 * n] = _ON_THE_WAY
        self._at_the_end[1:n], self._at_the_end[n : 2 * n] = _AT_THE_END
        assert start.torques is not None
        self._torques = start.torques

    def closed(self) -> Start | None:
        """Return the start of the closed cycle; None if it does not close."""
        run, weight = self._run(lambda i, x: self._torques[i]), 1.0
        for _ in range(_ROUNDS):
            if not np.isfinite(run.residual).all() or self._size(run) < _AIM:
                break
            run = self._improved(run, weight)
            weight *= _FACTOR
        if self._size(run) >= CLOSED:
            return None
        # The memory of the last round may be that of another start.
        memory = run.residual.copy()
        memory[self._moving] = 0.0
        self._start = self._strobe.displaced(self._start, memory)
        return replace(self._start, torques=run.torques)

    def _size(self, run: _Run) -> float:
        """Return the largest entry of the residual without the memory, in SI units."""
        return float(np.abs(run.residual[self._moving]).max())

    def _end(self, action: int) -> float:
        """Return the time at which an action ends [s]."""
        start = self._start
        tick = start.tick + (action + 1) * start.samples // len(self._torques)
        return tick * start.period

    def _run(self, law: Callable[[int, Array], Array]) -> _Run:
        """Simulate the cycle; ``law`` returns the torque (joints,) from action and state."""
        strobe, sim = self._strobe, self._strobe.sim
        before = strobe.at(self._start)
        leg = sim.support_leg
        states, torques = [], []
        end = np.full(len(before), np.inf)
        for i in range(len(self._torques)):
            if sim.support_leg != leg:
                break
            states.append(strobe.state)
            torques.append(law(i, states[-1]))
            if not sim.advance(self._end(i), torques[-1]):
                break
        else:
            if sim.support_leg != leg:
                end = strobe.back(self._start.steps) @ strobe.state
        return _Run(np.array(states), np.array(torques), end - before)

    def _changed(self, run: _Run, K: Sequence[Array], k: Sequence[Array]) -> _Run:
        """Run with the torques of a run, changed by the feedback K and by -k."""

        def law(i: int, x: Array) -> Array:
            torque = run.torques[i] - self._scale * (K[i] @ (x - run.states[i]) + k[i])
            limited: Array = torque.clip(-self._scale, self._scale)
            return limited

        return self._run(law)

    def _improved(self, run: _Run, weight: float) -> _Run:
        """Change the torques, then the start; return the best run."""
        K, k = self._feedback(run, weight)
        steered = [self._changed(run, K, [part * each for each in k]) for part in _PARTS]
        run = min([run, *steered], key=self._size)
        start, moved = self._start, [(run, self._start)]
        for part in _PARTS:
            self._start = self._strobe.displaced(start, part * run.residual)
            moved.append((self._changed(run, K, [np.zeros_like(each) for each in k]), self._start))
        run, self._start = min(moved, key=lambda each: self._size(each[0]))
        return run

    def _feedback(self, run: _Run, weight: float) -> tuple[list[Array], list[Array]]:
        """Return K (joints, s) and k (joints,) of each action that reduce the residual of a run."""
        strobe = self._strobe
        strobe.at(self._start)
        A, B = [], []
        for i, torque in enumerate(run.torques):
            lin = strobe.sim.linearize(torque, until=self._end(i))
            A.append(strobe.reduction @ lin.A)
            # A torque at its limit stays there.
            free = np.abs(torque) < self._scale
            B.append(strobe.reduction @ lin.B * (self._scale * free))
            strobe.sim.advance(self._end(i), torque)
        back, end = strobe.back(self._start.steps), weight * self._at_the_end
        residual = np.where(end > 0.0, run.residual, 0.0)
        return solve(
            A,
            B,
            np.diag(self._on_the_way),
            _TORQUE * np.eye(len(self._scale)),
            back.T @ np.diag(end) @ back,
            back.T @ (end * residual),
        )


def find(scene: Scene, policy: Policy | OrbitPolicy) -> Orbit:
    """Close an orbit of one gait step near the motion of a policy.

    Parameters
    ----------
    scene
        Scene of the motion, with an accuracy that `Simulator.linearize` accepts.
    policy
        Policy of the motion.

    Raises
    ------
    ValueError
        If the motion ends, or no step of it closes, or an action is no multiple of a sample.
    """
    strobe = Strobe(scene)
    strobe.sim.linearize()
    policy = policy.on(scene)
    scale = np.array(list(policy.action_scale.values()))
    for start in _candidates(strobe, policy):
        orbit = close(strobe, start, scale)
        if orbit is not None:
            return orbit
    raise ValueError(f"scene {scene.name}: no step of the policy's motion closes")


def close(strobe: Strobe, start: Start, scale: Array) -> Orbit | None:
    """Close an orbit near a start with torques; None if that fails.

    Parameters
    ----------
    strobe
        Map of the scene.
    start
        Near the orbit, with torques.
    scale
        Largest residual torque of each joint (joints,) [N m].
    """
    closed = _Cycle(strobe, start, scale).closed()
    if closed is None:
        return None
    residual, derivative = strobe.residual(closed), strobe.derivative(closed)
    orbit = Orbit(strobe, closed, residual, derivative, start.tick * start.period)
    return orbit if orbit.size < CLOSED else None


def _candidates(strobe: Strobe, policy: Policy | OrbitPolicy) -> list[Start]:
    """Return the steps of the most frequent duration that come nearest to themselves, in order."""
    sim, period = strobe.sim, strobe.period
    samples = round(sim.action_period / period)
    if not math.isclose(samples * period, sim.action_period):
        raise ValueError(
            f"control.action_period = {sim.action_period}: must be a multiple of "
            f"control.sample_period = {period}"
        )
    snapshots, states, torques, legs, contacts = [], [], [], [], []
    sim.reset()
    while sim.time < _SEARCHED:
        torques.append(policy.residual(sim))
        snapshots.append(sim.snapshot())
        states.append(strobe.state)
        legs.append(sim.support_leg)
        contacts.append(sim.state_number)
        if not sim.advance(len(torques) * samples * period, torques[-1]):
            raise ValueError(
                f"scene {strobe.scene.name}: with the policy: {sim.termination} after "
                f"{sim.time:.2f} s"
            )
    n = strobe.n
    weights = np.zeros(len(strobe.mirror))
    weights[1:n], weights[n : 2 * n] = 1.0, _VELOCITY
    swaps = [i for i in range(1, len(legs)) if legs[i] != legs[i - 1]]
    if len(swaps) < 2:
        raise ValueError(f"scene {strobe.scene.name}: {len(swaps)} gait steps with the policy")
    # Unusual durations make orbits from which the feedback falls more often.
    length = mode(np.diff(swaps).tolist())
    found = []
    for first in swaps:
        last = first + length
        one_leg = set(legs[first:last]) == {legs[first]}
        if last < len(legs) and one_leg and contacts[last] == contacts[first]:
            miss = weights * (strobe.back(1) @ states[last] - states[first])
            found.append((float(np.abs(miss).max()), first))
    return [
        Start(
            snapshots[first],
            first * samples,
            period,
            1,
            length * samples,
            np.array(torques[first : first + length]),
            legs[first],
        )
        for _, first in sorted(found)[:_CANDIDATES]
    ]
