"""The motion of a gait: a recording with close samples, and its complete steps."""

from collections.abc import Callable
from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from .._core import Scene, Simulator
from ..replay import Array, Recording, ResidualPolicy, record
from .contact_sequence import StepOrder, step_orders

# Time between two samples [s]; the shortest states last a few milliseconds.
SAMPLE_PERIOD = 1e-3


@dataclass(frozen=True)
class Motion:
    """A motion; all figures are over its complete steps.

    A complete step lies between two swaps of the legs that each end a step of at least 0.1 s; the
    way from the start to the first swap is none.

    Attributes
    ----------
    recording
        Samples, `SAMPLE_PERIOD` apart, events and steps.
    asked
        Number of steps that the simulation was to make.
    """

    recording: Recording
    asked: int

    @cached_property
    def scene(self) -> Scene:
        """The scene that was simulated."""
        return self.recording.scene

    @cached_property
    def weight(self) -> float:
        """Body weight [N]."""
        bodies = Simulator(self.scene).bodies()
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

    def peaks(self, values: Array) -> dict[str, float]:
        """Largest magnitude of every joint's value (T, n) in the complete steps; none without."""
        if not self.shown.any():
            return {}
        names = self.recording.metadata["coordinate_names"]
        largest = np.abs(values[self.shown]).max(axis=0).tolist()
        return {name: x for name, x in zip(names, largest, strict=True) if name.startswith("q")}

    @property
    def torques(self) -> dict[str, float]:
        """Largest total torque of every joint in the complete steps [N m]."""
        return self.peaks(self.recording.torque)

    @cached_property
    def shown(self) -> NDArray[np.bool_]:
        """Mask of the samples in complete steps (T,)."""
        t = self.recording.t
        if self.swaps.size < 2:
            return np.zeros(t.size, np.bool_)
        shown: NDArray[np.bool_] = (t >= self.swaps[0]) & (t < self.swaps[-1])
        return shown


def orders_of(recording: Recording) -> list[StepOrder]:
    """Contact states of the complete steps of a recording."""
    return step_orders(recording.events.tolist(), recording.steps["time"].tolist())


def skate(
    sim: Simulator,
    steps: int,
    policy: ResidualPolicy | None = None,
    progress: Callable[[int], object] | None = None,
) -> Motion:
    """Simulate up to ``steps`` steps from the present state; ``progress`` as for `record`."""
    samples = max(round(sim.action_period / SAMPLE_PERIOD), 1)
    return Motion(record(sim, steps, 1, progress, policy, samples), steps)
