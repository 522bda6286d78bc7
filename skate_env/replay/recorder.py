"""Records simulations."""

import time
from collections.abc import Callable, Iterator, Mapping
from importlib.metadata import version
from typing import Any, Protocol

import numpy as np

from .._core import Simulator
from ..common import count
from .receipt import Receipt
from .recording import EVENT, STEP, STEP_UNITS, Array, Recording

# A recording ends after this time without a gait step [s].
LONGEST_STEP = 20.0


class ResidualPolicy(Protocol):
    """A `Policy`, or what replaces one in `record`."""

    @property
    def about(self) -> Mapping[str, Any] | None:
        """Whatever is worth knowing of it, for JSON."""

    def residual(self, sim: Simulator) -> Array | None:
        """Torques (joints,) [N m] to hold over the next action period; None for none."""


def record(
    sim: Simulator,
    steps: int,
    every: int = 1,
    progress: Callable[[int], object] | None = None,
    policy: ResidualPolicy | None = None,
    per_action: int = 1,
) -> Recording:
    """Simulate until ``steps`` gait steps are complete or the simulation ends.

    Parameters
    ----------
    sim
        Simulator in the state to start from.
    steps
        Number of gait steps (leg swaps).
    every
        Number of action periods per sample.
    progress
        Called with the number of newly completed steps, like ``tqdm.update``.
    policy
        Policy whose residual is constant over each action period; None for no residual.
    per_action
        Samples in each action period. Those within it are of a copy, so the motion has the same
        bits with any number of them.

    Raises
    ------
    TypeError, ValueError
        If ``steps``, ``every`` or ``per_action`` is not an int of at least 1.
    """
    steps, every = count("steps", steps), count("every", every)
    per_action = count("per_action", per_action)
    copy = Simulator(sim.scene)
    receipt = Receipt(sim)
    samples = [_sample(sim)]
    events: list[tuple[float, str, int, int, str]] = []
    rows: list[dict[str, float]] = []
    wall_time = 0.0
    periods = 0
    last_swap = sim.time
    termination = sim.termination
    while len(rows) < steps and termination is None:
        residual = policy.residual(sim) if policy else None
        samples += _samples_within(sim, copy, residual, per_action)
        before = time.perf_counter()
        sim.step(residual)
        wall_time += time.perf_counter() - before
        receipt.add(residual, sim)
        periods += 1
        if periods % every == 0:
            samples.append(_sample(sim))
        events += sim.take_events()
        done = sim.take_steps()
        if done:
            rows += done
            last_swap = sim.time
            if progress:
                progress(len(done))
        termination = sim.termination
        if termination is None and sim.time - last_swap > LONGEST_STEP:
            termination = "no_step"
    # A termination after the last requested step does not count.
    reached = len(rows) >= steps
    columns = zip(*samples, strict=True)
    t, q, v, acceleration, torque, state, right, forces, head, segments = map(np.array, columns)
    return Recording(
        t=t,
        q=q,
        v=v,
        acceleration=acceleration,
        torque=torque,
        state_number=state,
        right_support=right,
        contact_forces=forces,
        head=head,
        segments=segments,
        events=np.array(events, dtype=EVENT),
        steps=np.array([tuple(row[name] for name in STEP_UNITS) for row in rows], dtype=STEP),
        **receipt.fields(),
        metadata={
            "scene": sim.scene.to_toml(),
            "coordinate_names": sim.coordinate_names,
            "policy": policy.about if policy else None,
            "termination": None if reached else termination,
            "wall_time": wall_time,
            "stats": sim.stats(),
            "totals": sim.totals(),
            "version": version("skate-env"),
            "checksum": receipt.checksum(),
        },
    )


def _samples_within(
    sim: Simulator, copy: Simulator, residual: Array | None, parts: int
) -> Iterator[tuple[Any, ...]]:
    """Sample the coming action between its ends, in a copy that makes it in parts."""
    if parts > 1:
        copy.restore(sim.snapshot())
    for part in range(1, parts):
        if not copy.advance(sim.time + part * sim.action_period / parts, residual):
            return
        yield _sample(copy)


def _sample(sim: Simulator) -> tuple[Any, ...]:
    return (
        sim.time,
        sim.q,
        sim.v,
        sim.acceleration,
        sim.torque,
        sim.state_number,
        sim.support_leg == "right",
        sim.contact_forces,
        sim.head_position,
        sim.link_segments().astype(np.float32),
    )
