"""An action of 10 ms with its Jacobian, in the engine and in MuJoCo."""

import copy
import time
from collections.abc import Hashable
from typing import Any, Protocol

import numpy as np

from skate_env._core import Simulator
from skate_env.studies.motions.cases import Array, Case
from skate_env.studies.motions.mujoco_model import Setting, package
from skate_env.studies.motions.mujoco_motion import Motion

PERIOD = 0.01
"""Duration of an action [s]."""
TOLERANCE = 1e-13
"""Of the engine's motions: differences need the tightest."""

COARSE, FINE = 1e-6, 1e-8
"""Steps of MuJoCo's differences: that of its own examples, and a smaller one."""

_TORQUE = 3.0


class Action(Protocol):
    """A start, and the map of an action from it."""

    noise: float
    """By which two motions differ whatever the displacement."""

    def end(self, dx: Array) -> tuple[Array, Hashable]:
        """State after the action from a displaced start, and its sequence of events."""

    def jacobian(self) -> tuple[Array, float, float]:
        """Jacobian by the state (s, s), its time, and that of the action [s]."""

    def has_events(self) -> bool:
        """Whether the contact changes during the action."""

    def is_flagged(self) -> bool:
        """Whether the engine names a reason why the derivative may not exist."""


class EngineAction(Action):
    """An action of the engine."""

    noise = 1e-11

    def __init__(self, case: Case, rng: np.random.Generator, start: int) -> None:
        self.sim = Simulator(case.with_accuracy(TOLERANCE))
        self.sim.reset(*case.start(start))
        self.torque = rng.uniform(-_TORQUE, _TORQUE, len(self.sim.q) - 3)
        if case.torque is not None:
            self.torque += case.torque
        if (until := rng.uniform(0.0, case.duration)) > 0.0:
            self.sim.advance(until, self.torque)
        self.until = self.sim.time + PERIOD
        self.size = 2 * len(self.sim.q)

    def end(self, dx: Array) -> tuple[Array, Hashable]:
        sim = copy.copy(self.sim)
        if dx.any():
            sim.displace(np.append(dx, np.zeros(4)))
        sim.take_events()
        sim.advance(self.until, self.torque)
        return sim.state_vector()[: self.size], tuple(event[1:] for event in sim.take_events())

    def jacobian(self) -> tuple[Array, float, float]:
        moved = copy.copy(self.sim)
        begun = time.perf_counter()
        moved.advance(self.until, self.torque)
        between = time.perf_counter()
        self._lin = self.sim.linearize(self.torque, self.until)
        after = time.perf_counter()
        A = self._lin.A[: self.size, : self.size]
        return A, after - between, between - begun

    def has_events(self) -> bool:
        return bool(self._lin.events)

    def is_flagged(self) -> bool:
        return bool(self._lin.nonsmooth)


class MujocoAction(Action):
    """An action of MuJoCo: the product of ``mjd_transitionFD`` over its steps, central differences.

    With a step below `COARSE` MuJoCo's solver iterates until nothing changes.
    """

    noise = 1e-12

    def __init__(
        self,
        case: Case,
        rng: np.random.Generator,
        start: int,
        setting: Setting,
        epsilon: float,
    ) -> None:
        self.mj = package()
        motion = Motion(case, setting, start)
        self.model, self.data = motion.model, motion.data
        self.steps = round(PERIOD / setting.timestep)
        self.epsilon = epsilon
        if epsilon < COARSE:
            # The solver's error is divided by the step.
            self.model.opt.tolerance, self.model.opt.iterations = 0.0, 200
            self.model.opt.ls_iterations = 100
        torque = rng.uniform(-_TORQUE, _TORQUE, self.model.nv - 3)
        self.data.qfrc_applied[3:] += torque
        motion.advance(int(rng.uniform(0.0, case.duration) / setting.timestep))
        self._start = self._saved()
        self.size = 2 * self.model.nv

    def _saved(self) -> Any:
        spec = self.mj.mjtState.mjSTATE_INTEGRATION
        state = np.empty(self.mj.mj_stateSize(self.model, spec))
        self.mj.mj_getState(self.model, self.data, state, spec)
        return state

    def _restore(self) -> None:
        spec = self.mj.mjtState.mjSTATE_INTEGRATION
        self.mj.mj_setState(self.model, self.data, self._start, spec)

    def _active(self) -> Hashable:
        """Contacts of the last step with the zones of their forces in the friction cone."""
        contacts = [(int(c.geom1), int(c.geom2)) for c in self.data.contact]
        return tuple(contacts), tuple(self.data.efc_state.tolist())

    def end(self, dx: Array) -> tuple[Array, Hashable]:
        self._restore()
        nv, passed = self.model.nv, []
        self.data.qpos += dx[:nv]
        self.data.qvel += dx[nv:]
        for _ in range(self.steps):
            self.mj.mj_step(self.model, self.data)
            passed.append(self._active())
        self._passed = passed
        return np.concatenate([self.data.qpos, self.data.qvel]), tuple(passed)

    def jacobian(self) -> tuple[Array, float, float]:
        self._restore()
        begun = time.perf_counter()
        self.mj.mj_step(self.model, self.data, nstep=self.steps)
        moved = time.perf_counter() - begun
        self._restore()
        product, A = np.eye(self.size), np.zeros((self.size, self.size))
        spent = 0.0
        for _ in range(self.steps):
            begun = time.perf_counter()
            self.mj.mjd_transitionFD(self.model, self.data, self.epsilon, True, A, None, None, None)
            self.mj.mj_step(self.model, self.data)
            product = A @ product
            spent += time.perf_counter() - begun
        return product, spent, moved

    def has_events(self) -> bool:
        self.end(np.zeros(self.size))
        return any(active != self._passed[0] for active in self._passed)

    def is_flagged(self) -> bool:
        # MuJoCo names no reasons.
        return False
