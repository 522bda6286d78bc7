"""How long short blocks of work take, all of them measured in turn.

A machine's speed changes by tens of per cent within a second. Blocks that take their turns see
the same machine, and the least of many rounds is what the machine needs when left alone.
"""

import math
import random
import time
from collections.abc import Callable, Sequence
from importlib import import_module
from typing import Any

import numpy as np
from numpy.typing import NDArray

from .._core import Scene, Simulator
from ..mjcf import to_mjcf

Array = NDArray[np.float64]
Block = Callable[[], int]
"""Do some work; returns what it took [ns], preparations left out."""

# A block that takes longer than this [s] takes its turn less often, but so often at least.
_SHORT, _FEWEST = 2e-3, 20
# MuJoCo's steps in a block, and their length [s].
_MUJOCO_STEPS, _MUJOCO_TIMESTEP = 100, 0.001


def engine(sim: Simulator) -> Block:
    """Make a block of one action period from the scene's start."""

    def block() -> int:
        sim.reset()
        before = time.perf_counter_ns()
        sim.step()
        return time.perf_counter_ns() - before

    return block


def mujoco(scene: Scene) -> Block:
    """Make a block of MuJoCo's steps with a scene's bodies from its start, touching nothing.

    ImportError where MuJoCo is not installed.
    """
    mj = _mujoco()
    model = mj.MjModel.from_xml_string(to_mjcf(scene, timestep=_MUJOCO_TIMESTEP))
    # Nor does it look for what might touch.
    model.opt.disableflags |= mj.mjtDisableBit.mjDSBL_CONTACT
    data = mj.MjData(model)
    start = Simulator(scene)
    q, v = start.q, start.v

    def block() -> int:
        mj.mj_resetData(model, data)
        data.qpos[:], data.qvel[:] = q, v
        before = time.perf_counter_ns()
        mj.mj_step(model, data, nstep=_MUJOCO_STEPS)
        return time.perf_counter_ns() - before

    return block


def mujoco_version() -> str:
    """Name MuJoCo's version."""
    return str(_mujoco().__version__)


def interleaved(blocks: Sequence[Block], rounds: int, progress: Callable[[], object]) -> Array:
    """Time the blocks in turn, in a new order each round; (blocks, rounds) [s].

    A block that takes long takes its turn less often, but `_FEWEST` times if there are as many
    rounds; where it does not, its time is NaN.
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
    """Give the least time of every block: of all rounds, of the first and of the second half."""
    middle = times.shape[1] // 2
    whole, first, second = (
        np.nanmin(part, axis=1) for part in (times, times[:, :middle], times[:, middle:])
    )
    return whole, first, second


def ratios(times: Array) -> tuple[list[float], list[float], float]:
    """Divide the least times by the first block's.

    Returns
    -------
    tuple
        The least times, their ratios, and the largest relative disagreement of a ratio between
        the first and the second half of the rounds.
    """
    whole, first, second = least(times)
    error = np.abs((first / first[0]) / (second / second[0]) - 1.0).max()
    return whole.tolist(), (whole / whole[0]).tolist(), float(error)


def _mujoco() -> Any:
    # An extra of the tests; without it the package works.
    return import_module("mujoco")
