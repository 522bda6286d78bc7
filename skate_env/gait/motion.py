"""The motion that a card describes: a recording, samples of it, and its complete steps."""

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from functools import cached_property
from typing import Any

import numpy as np
from numpy.typing import NDArray

from .._core import Scene, Simulator
from ..environments import IceSkateEnv
from ..replay import Array, Recording, ResidualPolicy, record
from .contact_sequence import StepOrder, step_orders

# Time between two samples [s]; the shortest states last a few milliseconds.
SAMPLE_PERIOD = 1e-3
# For `record`: no sample but the first, where only events and steps count.
ONLY_FIRST = 10**9
# Row of the head in `Simulator.link_segments`.
HEAD = 16
# Units of the feedforward torques in an observation [N m], from Eqs. 16 to 22.
FEEDFORWARD_UNITS = {1: 100.0, 2: 205.0, 3: 50.0, 5: 100.0, 6: 20.0, 7: 50.0, 8: 30.0}


@dataclass(frozen=True)
class Samples:
    """T samples, `SAMPLE_PERIOD` apart, of a motion with n coordinates and d observations.

    Attributes
    ----------
    t
        Time (T,) [s].
    q, v
        Coordinates (T, n) [m, rad] and their rates.
    torque, residual
        Total torque, and that of the policy, zero without one (T, n) [N m].
    state_number
        Row of Table 2 (T,), 0 with both feet off the ice.
    contact_forces
        (T, 2, 4) [N], as `Simulator.contact_forces`.
    gaps
        Heights of heel and toe of the supporting and the free foot (T, 2, 2) [m].
    head, psi
        Heights of the top of the head and of the point psi of Eq. 14 (T,) [m].
    observation
        As `Simulator.observation` (T, d), single precision; d = 0 where it was not sampled.
    """

    t: Array
    q: Array
    v: Array
    torque: Array
    residual: Array
    state_number: NDArray[np.int64]
    contact_forces: Array
    gaps: Array
    head: Array
    psi: Array
    observation: NDArray[np.float32]


class Sampler:
    """Samples a simulation between its actions, without a change of its integration.

    Before every action of more than `SAMPLE_PERIOD`, a copy of the simulator makes the same action
    in parts. Use it as the policy of `record`. ``observe`` samples observations.
    """

    def __init__(self, sim: Simulator, policy: ResidualPolicy | None, observe: bool) -> None:
        self.about: Mapping[str, Any] | None = policy.about if policy else None
        self.rows: list[tuple[Any, ...]] = []
        self._policy, self._copy = policy, Simulator(sim.scene)
        self._parts = max(round(sim.action_period / SAMPLE_PERIOD), 1)
        self._applied = np.zeros(sim.q.size)
        self._psi = sim.scene.get("control.psi")
        self._observe = observe

    def residual(self, sim: Simulator) -> Array | None:
        """Sample the coming action; return its residual (joints,) [N m], None without a policy."""
        residual = self._policy.residual(sim) if self._policy else None
        begin = sim.time
        self._sample(sim)
        if self._parts > 1:
            self._copy.restore(sim.snapshot())
        if residual is not None:
            self._applied = np.concatenate([np.zeros(sim.q.size - residual.size), residual])
        for part in range(1, self._parts):
            if not self._copy.advance(begin + part * SAMPLE_PERIOD, residual):
                break
            self._sample(self._copy)
        return residual

    def _sample(self, sim: Simulator) -> None:
        head = psi = sim.head_position[2]
        if self._psi != 1.0:
            neck, top = sim.link_segments()[HEAD, :, 2]
            psi = neck + self._psi * (top - neck)
        self.rows.append(
            (
                sim.time,
                sim.q,
                sim.v,
                sim.torque,
                # The torque of an action's first instant includes the previous residual.
                self._applied,
                sim.state_number,
                sim.contact_forces,
                sim.gaps(),
                head,
                psi,
                sim.observation() if self._observe else (),
            )
        )


@dataclass(frozen=True)
class Motion:
    """A motion; all figures are over its complete steps.

    A complete step lies between two swaps of the legs that each end a step of at least 0.1 s; the
    way from the start to the first swap is none.

    Attributes
    ----------
    recording
        Events and steps.
    samples
        Samples.
    asked
        Number of steps that the simulation was to make.
    """

    recording: Recording
    samples: Samples
    asked: int

    @cached_property
    def scene(self) -> Scene:
        """The scene that was simulated."""
        return self.recording.scene

    @cached_property
    def weight(self) -> float:
        """Body weight [N]."""
        bodies = Simulator(self.recording.scene).bodies()
        return float(self.scene.get("ice.gravity") * sum(body["mass"] for body in bodies))

    @cached_property
    def orders(self) -> list[StepOrder]:
        """Contact states of the complete steps."""
        return orders_of(self.recording)

    @property
    def swaps(self) -> Array:
        """Times of the swaps around the complete steps (steps + 1,) [s]."""
        times: Array = self.recording.steps["time"]
        return times

    @property
    def steps(self) -> NDArray[np.void]:
        """Rows of the complete steps in the table of steps."""
        return self.recording.steps[1:]

    def step_mean(self, column: str) -> float:
        """Mean of a column of the table of steps."""
        return float(self.steps[column].mean()) if self.steps.size else np.nan

    @property
    def speed(self) -> float:
        """Progress of the hips over time [m/s]."""
        return self.step_mean("progress") / self.step_mean("period")

    @cached_property
    def shown(self) -> NDArray[np.bool_]:
        """Mask of the samples in complete steps (T,)."""
        t = self.samples.t
        if self.swaps.size < 2:
            return np.zeros(t.size, np.bool_)
        shown: NDArray[np.bool_] = (t >= self.swaps[0]) & (t < self.swaps[-1])
        return shown

    def observed(self, *names: str) -> Array:
        """Entries of the observation (T, names); zero for one that the scene does not have."""
        known = self._observation_names
        values = np.zeros((self.samples.t.size, len(names)))
        for i, name in enumerate(names):
            if name in known:
                values[:, i] = self.samples.observation[:, known.index(name)]
        return values

    @cached_property
    def _observation_names(self) -> list[str]:
        return list(IceSkateEnv(self.recording.scene).observation_names)

    @cached_property
    def feedforward(self) -> Array:
        """Torques of Eqs. 16 to 22 (T, n) [N m]."""
        torque = np.zeros_like(self.samples.torque)
        for joint, unit in FEEDFORWARD_UNITS.items():
            column = self.recording.index(f"q{joint}")
            if column is not None:
                torque[:, column] = unit * self.observed(f"feedforward.tau{joint}")[:, 0]
        return torque

    @cached_property
    def feedback(self) -> Array:
        """Torques of lifting and stabilizers (T, n) [N m]."""
        return self.samples.torque - self.feedforward - self.samples.residual


def orders_of(recording: Recording) -> list[StepOrder]:
    """Contact states of the complete steps of a recording."""
    return step_orders(recording.events.tolist(), recording.steps["time"].tolist())


def skate(
    sim: Simulator,
    steps: int,
    policy: ResidualPolicy | None = None,
    progress: Callable[[int], object] | None = None,
    observe: bool = True,
) -> Motion:
    """Simulate up to ``steps`` steps from the present state; ``progress`` as for `record`.

    Without ``observe`` the observations are not sampled, which takes most of the time; `Motion`'s
    ``feedforward`` and ``feedback`` need them.
    """
    sampler = Sampler(sim, policy, observe)
    recording = record(sim, steps, every=ONLY_FIRST, progress=progress, policy=sampler)
    if not sampler.rows:
        # It had ended before.
        sampler.residual(sim)
    samples = Samples(*map(np.array, zip(*sampler.rows, strict=True)))
    return Motion(recording, samples, steps)
