"""A long run of vector environments over random scenes: finite numbers, and no growth of memory.

The long test makes SOAK actions of single environments, by default 300,000, with the accuracy
SOAK_ACCURACY, by default ``fast``, and scenes of the seed SOAK_SEED, by default 0. Two hours on two
cores: ``SOAK=1_000_000_000 pytest tests/test_soak.py``; a quarter of an hour:
``SOAK=10_000_000 SOAK_ACCURACY=balanced pytest tests/test_soak.py``.
"""

import ctypes
import gc
import itertools
import os
from collections import Counter
from collections.abc import Iterator
from pathlib import Path

import numpy as np
import pytest

from skate_env.environments import PAPER_ACTIONS, IceSkateVectorEnv
from skate_env.environments import joints as movable
from tests.campaigns.draw import draw_scene, torque_scale
from tests.campaigns.episode import LONGEST

# Mean number of episodes per environment that end a scene, so that none ends all the time.
EPISODES = 5
# Largest relative growth of the resident memory, and fewest scenes whose memory is judged: at first
# the allocator takes pieces as large as a batch.
MOST_GROWTH, LEAST_SCENES = 0.01, 500
# Standard deviation of the starts, in half of the scenes [rad, rad/s].
PERTURBED = 0.02
STATM = Path("/proc/self/statm")


def resident() -> int | None:
    """Return the resident memory of the process [bytes], or None where the system does not tell it.

    Free pages do not count where the allocator is glibc's: it keeps some at random, so that a run
    without a leak may seem to grow. ``malloc_trim`` gives them back.
    """
    if not STATM.exists():
        return None
    gc.collect()
    trim = getattr(ctypes.CDLL(None), "malloc_trim", None)
    if trim is not None:
        trim(0)
    return int(STATM.read_text().split()[1]) * os.sysconf("SC_PAGE_SIZE")


def growth(memory: list[int]) -> float:
    """Relative growth of the median memory from the second quarter of a run to the last."""
    quarter = len(memory) // 4
    before, after = memory[quarter : 2 * quarter], memory[-quarter:]
    return float(np.median(after) / np.median(before)) - 1.0


def skate(
    seed: int, number: int, environments: int, threads: int, longest: int, accuracy: str
) -> Iterator[np.ndarray]:
    """Step all environments of a random scene, ``longest`` times at most; yield all numbers."""
    rng = np.random.default_rng(np.random.SeedSequence([seed, number]))
    scene = draw_scene(rng, accuracy)
    scales, joints = PAPER_ACTIONS["action_scale"], movable(scene)
    scale = torque_scale(rng, np.array([scales[joint] for joint in joints]))
    try:
        envs = IceSkateVectorEnv(
            environments,
            scene,
            max_episode_steps=LONGEST,
            autoreset_mode="SameStep",
            num_threads=threads,
            joints=joints,
            action_scale=dict(zip(joints, scale.tolist(), strict=True)),
            mirrored=bool(rng.integers(2)),
            perturb=PERTURBED * float(rng.integers(2)),
        )
        envs.reset(seed=int(rng.integers(2**31)))
    except ValueError:  # The scene has no valid start.
        return
    ends = 0
    for _ in range(longest):
        if ends >= EPISODES * environments:
            return
        actions = rng.uniform(-1.0, 1.0, envs.action_space.shape).astype(np.float32)
        observations, rewards, terminated, truncated, infos = envs.step(actions)
        over = terminated | truncated
        ends += np.count_nonzero(over)
        final = np.stack(infos["final_obs"][over]) if over.any() else observations[:0]
        yield np.concatenate([np.ravel(part) for part in (observations, rewards, final)])


def made(
    seed: int,
    actions: int,
    environments: int,
    threads: int,
    longest: int = 40,
    accuracy: str = "fast",
) -> Counter[str]:
    """Run scenes until they have this number of actions; count, and check numbers and memory."""
    count, memory = Counter[str](), []
    for number in itertools.count():
        if count["actions"] >= actions:
            break
        for step in skate(seed, number, environments, threads, longest, accuracy):
            assert np.isfinite(step).all(), f"scene {number}: {step[~np.isfinite(step)]}"
            count["actions"] += environments
            count["bits"] = hash((count["bits"], step.tobytes()))
        count["scenes"] += 1
        if (bytes_now := resident()) is not None:
            memory.append(bytes_now)
    if len(memory) >= LEAST_SCENES:
        assert growth(memory) <= MOST_GROWTH, f"the memory grows by {growth(memory):.2%}"
    return count


@pytest.mark.long("hundreds of random scenes in batches")
def test_numbers_are_finite_and_the_memory_does_not_grow():
    asked, cores = os.environ.get("SOAK"), os.cpu_count() or 1
    seed, accuracy = int(os.environ.get("SOAK_SEED", "0")), os.environ.get("SOAK_ACCURACY", "fast")
    actions = int(asked or "300_000")
    environments, longest = (256, 500) if asked else (16, 40)
    count = made(seed, actions, environments, cores, longest, accuracy)
    assert count["actions"] >= actions and (asked or count["scenes"] >= LEAST_SCENES)


def test_a_run_is_a_function_of_its_arguments():
    one, two, other = (
        made(*given) for given in ((1, 2000, 20, 1), (1, 2000, 20, 2), (2, 2000, 20, 1))
    )
    assert one == two != other


def test_growth_by_hand():
    assert growth(125 * [9] + 125 * [100] + 125 * [50] + 125 * [102]) == pytest.approx(0.02)


def test_free_memory_does_not_count():
    """Blocks in front of one that stays: freed, they remain in the allocator's heap."""
    libc = ctypes.CDLL(None)
    if resident() is None or not hasattr(libc, "malloc_trim"):
        pytest.skip("the system does not tell the memory, or the allocator is not glibc's")
    libc.malloc.restype, libc.malloc.argtypes = ctypes.c_void_p, [ctypes.c_size_t]
    libc.free.restype, libc.free.argtypes = None, [ctypes.c_void_p]
    blocks = [libc.malloc(8192) for _ in range(4000)]
    for block in blocks:
        ctypes.memset(block, 1, 8192)
    held = resident()
    for block in blocks[:-1]:
        libc.free(block)
    after = resident()
    libc.free(blocks[-1])
    # Measured: 32.8 MB of 32.8 MB.
    assert held - after > 30e6


def test_a_number_that_is_not_finite_is_found(monkeypatch):
    step = IceSkateVectorEnv.step

    def broken(self, actions):
        observations, *rest = step(self, actions)
        observations[3, 0] = np.nan
        return observations, *rest

    monkeypatch.setattr(IceSkateVectorEnv, "step", broken)
    with pytest.raises(AssertionError, match=r"scene .*nan"):
        made(1, 10**6, 5, 1)
