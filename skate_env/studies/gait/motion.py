"""The motion that a card describes: samples of a simulation and its complete steps."""

import json
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from functools import cached_property
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ..._core import Scene, Simulator
from ...contact_sequence import StepOrder, step_orders
from ...env import IceSkateEnv
from ...policy import Policy
from ...recording import Array, Recording, record
from ...scenes import replace

# Time between two samples [s]; the shortest states last a few milliseconds.
SAMPLE_PERIOD = 1e-3
# Units of the feedforward torques in an observation [N m], from Eqs. 16 to 22.
FEEDFORWARD_UNITS = {1: 100.0, 2: 205.0, 3: 50.0, 5: 100.0, 6: 20.0, 7: 50.0, 8: 30.0}


class Probe:
    """Logs observations of a simulator at every sample, and holds a policy's residual.

    Parameters
    ----------
    policy
        Policy, or None for no residual.
    hold
        Number of samples over which a residual is held.
    """

    def __init__(self, policy: Policy | None, hold: int) -> None:
        self.about: Mapping[str, Any] | None = policy.about if policy else None
        self.observations: list[NDArray[np.float32]] = []
        self.residuals: list[Array] = []
        self.hold, self._policy = hold, policy

    def residual(self, sim: Simulator) -> Array | None:
        """Log the present sample; return the residual of the next one (joints,) [N m], or None."""
        if self._policy is not None and len(self.observations) % self.hold == 0:
            self.residuals.append(self._policy.residual(sim))
        self.observations.append(sim.observation())
        return self.residuals[-1] if self.residuals else None


@dataclass(frozen=True)
class Motion:
    """T samples of a simulation with n coordinates; all figures are over its complete steps.

    A complete step lies between two swaps of the legs that each end a step of at least 0.1 s; the
    way from the start to the first swap is none.

    Attributes
    ----------
    recording
        Samples every `SAMPLE_PERIOD`, events and steps.
    asked
        Number of steps that the simulation was to make.
    feedforward
        Torques of Eqs. 16 to 22 (T, n) [N m].
    residual
        Torques of the policy (T, n) [N m], zero without one.
    head_error
        Head minus its target (T, 3) [m].
    free_foot
        Heights of the free heel and toe (T, 2) [m].
    """

    recording: Recording
    asked: int
    feedforward: Array
    residual: Array
    head_error: Array
    free_foot: Array

    @cached_property
    def scene(self) -> dict[str, Any]:
        """Fields of the scene."""
        fields: dict[str, Any] = json.loads(self.recording.scene.to_json())
        return fields

    @cached_property
    def weight(self) -> float:
        """Body weight [N]."""
        bodies = Simulator(self.recording.scene).bodies()
        gravity: float = self.scene["ice"]["gravity"]
        return gravity * float(sum(body["mass"] for body in bodies))

    @cached_property
    def orders(self) -> list[StepOrder]:
        """Contact states of the complete steps."""
        return orders_of(self.recording)

    @cached_property
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
        t = self.recording.t
        if self.swaps.size < 2:
            return np.zeros(t.size, np.bool_)
        shown: NDArray[np.bool_] = (t >= self.swaps[0]) & (t < self.swaps[-1])
        return shown

    @cached_property
    def feedback(self) -> Array:
        """Torques of lifting and stabilizers (T, n) [N m]."""
        return self.recording.torque - self.feedforward - self.residual


def orders_of(recording: Recording) -> list[StepOrder]:
    """Contact states of the complete steps of a recording."""
    return step_orders(recording.events.tolist(), recording.steps["time"].tolist())


def skate(
    scene: Scene, steps: int, policy: Policy | None, progress: Callable[[int], object]
) -> Motion:
    """Simulate up to ``steps`` steps from the scene's start; ``progress`` as for `record`."""
    period: float = json.loads(scene.to_json())["control"]["action_period"]
    probe = Probe(policy, max(round(period / SAMPLE_PERIOD), 1))
    sim = Simulator(replace(scene, {"control.action_period": SAMPLE_PERIOD}))
    recording = record(sim, steps, progress=progress, policy=probe)
    probe.observations.append(sim.observation())
    names = IceSkateEnv(scene).observation_names
    seen = np.array(probe.observations, np.float64)

    def columns(*wanted: str) -> Array:
        return seen[:, [names.index(name) for name in wanted]]

    feedforward, residual = np.zeros_like(recording.q), np.zeros_like(recording.q)
    for joint, unit in FEEDFORWARD_UNITS.items():
        column, name = recording.index(f"q{joint}"), f"feedforward.tau{joint}"
        if column is not None and name in names:
            feedforward[:, column] = unit * columns(name)[:, 0]
    if probe.residuals:
        # The torque of a sample includes the residual of the action that leads to it.
        actions = np.repeat(probe.residuals, probe.hold, axis=0)[: recording.t.size - 1]
        residual[1:, -actions.shape[1] :] = actions
    return Motion(
        recording=recording,
        asked=steps,
        feedforward=feedforward,
        residual=residual,
        head_error=columns("head_error.x", "head_error.y", "head_error.z"),
        free_foot=columns("height.free_heel", "height.free_toe"),
    )
