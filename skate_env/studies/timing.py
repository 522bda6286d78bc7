"""Times of short blocks of work, measured alternately.

The speed of a machine changes by tens of per cent within a second. Alternating blocks are measured
under the same conditions, and the least time of many rounds is that of an idle machine.

A block of the engine is a motion, timed from outside, or a part of a step (`inside`), which the
engine repeats and times itself, without the cost of calls from Python. `callgrind` counts
instructions, which do not depend on the load of the machine.
"""

import math
import random
import time
from collections.abc import Callable, Sequence

import numpy as np
from numpy.typing import NDArray

from .._core import Scene, Simulator
from ..scenes import to_mjcf
from .motions.mujoco_model import package

Array = NDArray[np.float64]
Block = Callable[[], int]
"""Does some work and returns its time [ns], without preparations."""

# Blocks longer than `_SHORT` [s] are skipped in some rounds, but run at least `_FEWEST` times.
_SHORT, _FEWEST = 2e-3, 20
# MuJoCo's steps in a block, and their length [s].
_MUJOCO_STEPS, _MUJOCO_TIMESTEP = 100, 0.001


def timed(work: Callable[[], object], prepare: Callable[[], object] | None = None) -> Block:
    """Return a block that does some work; `prepare` is called before it and not timed."""

    def block() -> int:
        if prepare is not None:
            prepare()
        before = time.perf_counter_ns()
        work()
        return time.perf_counter_ns() - before

    return block


def inside(sims: Sequence[Simulator], work: str, repeats: int) -> Block:
    """Return a block of a part of a step, repeated from the state of each simulator.

    `work` is one of the names of `Simulator.measure`.
    """

    def block() -> int:
        return round(1e9 * sum(sim.measure(work, repeats) for sim in sims))

    return block


def mujoco(scene: Scene) -> Block:
    """Return a block of MuJoCo's steps with a scene's bodies from its start, without contact.

    Raises
    ------
    ImportError
        If MuJoCo is not installed.
    """
    mj = package()
    model = mj.MjModel.from_xml_string(to_mjcf(scene, timestep=_MUJOCO_TIMESTEP))
    # Collision detection is off as well.
    model.opt.disableflags |= mj.mjtDisableBit.mjDSBL_CONTACT
    data = mj.MjData(model)
    start = Simulator(scene)
    q, v = start.q, start.v

    def prepare() -> None:
        mj.mj_resetData(model, data)
        data.qpos[:], data.qvel[:] = q, v

    return timed(lambda: mj.mj_step(model, data, nstep=_MUJOCO_STEPS), prepare)


def interleaved(blocks: Sequence[Block], rounds: int, progress: Callable[[], object]) -> Array:
    """Time the blocks alternately, in a new order each round; returns (blocks, rounds) [s].

    Long blocks are skipped in some rounds, where their time is NaN, but run at least `_FEWEST`
    times if there are as many rounds.
    """
    times = np.full((len(blocks), rounds), np.nan)
    most = max(1, rounds // _FEWEST)
    every = [min(most, math.ceil(1e-9 * block() / _SHORT)) for block in blocks]
    order = list(range(len(blocks)))
    shuffle = random.Random(0).shuffle
    for i in range(rounds):
        shuffle(order)
        for k in order:
            if i % every[k] == 0:
                times[k, i] = 1e-9 * blocks[k]()
        progress()
    return times


def least(times: Array) -> tuple[Array, Array, Array]:
    """Return the least time of every block: of all rounds, of the first and second half."""
    middle = times.shape[1] // 2
    whole, first, second = (
        np.nanmin(part, axis=1) for part in (times, times[:, :middle], times[:, middle:])
    )
    return whole, first, second


def ratios(times: Array) -> tuple[list[float], list[float], float]:
    """Divide the least times by that of the first block.

    Returns
    -------
    tuple
        The least times, their ratios, and the largest relative difference of a ratio between
        the first and the second half of the rounds.
    """
    whole, first, second = least(times)
    error = np.abs((first / first[0]) / (second / second[0]) - 1.0).max()
    return whole.tolist(), (whole / whole[0]).tolist(), float(error)
