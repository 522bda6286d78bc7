"""The long run over vector environments: checks, memory, the command."""

import ctypes
import json

import numpy as np
import pytest

from tests.campaigns import soak
from tests.commands import invoke

DEPENDS_ON_THE_MACHINE = {"wall_time", "memory", "growth", "passed"}


@pytest.fixture(autouse=True)
def short(monkeypatch):
    monkeypatch.setattr(soak, "ACTIONS", 40)


def run(seed, threads):
    seen = []
    result = soak.make(seed, 4000, "fast", 20, threads, seen.append)
    assert sum(seen) == result.steps >= 4000
    return result


def test_a_run_is_a_function_of_its_arguments():
    one, two, other = (run(*given).summary() for given in ((1, 1), (1, 2), (2, 1)))
    for summary in (one, two, other):
        assert not summary["failures"]
        for key in DEPENDS_ON_THE_MACHINE:
            del summary[key]
    assert one == two != other
    assert one["steps"] <= 20 * 40 * one["scenes"]
    assert sum(one["ends"].values()) > 0


def test_growth_by_hand():
    result = soak.Result(0, "fast", 1, memory=125 * [9] + 125 * [100] + 125 * [50] + 125 * [102])
    assert result.growth == pytest.approx(0.02) and not result.passed
    assert "FAILED: the memory grows" in result.text()
    short = soak.Result(0, "fast", 1, memory=list(range(1, 500)))
    assert short.passed and short.summary()["growth"] is None
    assert "not judged" in short.text()


def test_free_memory_does_not_count():
    """Blocks in front of one that stays: freed, they remain in the allocator's heap."""
    libc = ctypes.CDLL(None)
    if soak.resident() is None or not hasattr(libc, "malloc_trim"):
        pytest.skip("the system does not tell the memory, or the allocator is not glibc's")
    libc.malloc.restype, libc.malloc.argtypes = ctypes.c_void_p, [ctypes.c_size_t]
    libc.free.restype, libc.free.argtypes = None, [ctypes.c_void_p]
    blocks = [libc.malloc(8192) for _ in range(4000)]
    for block in blocks:
        ctypes.memset(block, 1, 8192)
    held = soak.resident()
    for block in blocks[:-1]:
        libc.free(block)
    after = soak.resident()
    libc.free(blocks[-1])
    # Measured: 32.8 MB of 32.8 MB.
    assert held - after > 30e6


def test_a_number_that_is_not_finite_ends_the_run(monkeypatch):
    step = soak.IceSkateVectorEnv.step

    def broken(self, actions):
        observations, *rest = step(self, actions)
        observations[3, 0] = np.nan
        return observations, *rest

    monkeypatch.setattr(soak.IceSkateVectorEnv, "step", broken)
    result = soak.make(1, 10**6, "fast", 5, 1)
    assert [failure.kind for failure in result.failures] == ["not finite"]
    assert not result.passed and "FAILED: not finite, episode " in result.text()


def test_command():
    arguments = ["--steps", "500", "--environments", "5", "--threads", "1", "--json"]
    done = invoke("soak", *arguments)
    assert done.exit_code == 0, done.output
    summary = json.loads(done.stdout.splitlines()[-1])
    assert summary["steps"] >= 500 and summary["passed"] is True
