"""Sizes that no machine has: refused before anything is allocated."""

import resource
import subprocess
import sys

import gymnasium
import numpy as np
import pytest

from skate_env import Simulator, load_scene
from skate_env.environments import IceSkateVectorEnv

HUGE = [2**63, 2**64, 10**30, 10**5000]
huge = pytest.mark.parametrize("number", HUGE, ids=["2**63", "2**64", "10**30", "10**5000"])


@pytest.mark.parametrize("n", [10**9, 2**60, 2**62])
def test_more_environments_than_memory_are_refused_with_both_sizes(refused, n):
    words = (f"{n} environments take", "bytes of memory", "bytes each", "bytes are available")
    refused(ValueError, lambda: gymnasium.make_vec("IceSkate-v0", num_envs=n), *words)


@pytest.mark.parametrize("name", ["num_envs", "max_episode_steps", "num_threads"])
@huge
def test_counts_of_any_size_have_a_range(refused, name, number):
    refused(ValueError, lambda: IceSkateVectorEnv(**{name: number}), name, "from 1 to")


@pytest.mark.parametrize("number", [2**64, -1, -(10**30), 2])
def test_indices_of_any_size_have_a_range(refused, number):
    env = IceSkateVectorEnv(2)
    for call in (env.info, env.simulator):
        refused(ValueError, lambda call=call: call(number), "environment = ", "from 0 to 1")


@huge
def test_other_numbers_of_any_size_have_a_range(refused, number):
    sim = Simulator(load_scene("paper"))
    refused(ValueError, lambda: sim.measure("rhs", number), "repeats", "from 1 to")
    if number > 2**63:
        refused(ValueError, lambda: sim.perturb(0.1, number), "seed", "2**64 - 1")
        env = IceSkateVectorEnv(2)
        refused(ValueError, lambda: env.reset(seed=number), "seed", "2**64 - 1")


def test_a_limit_of_the_address_space_counts():
    code = (
        "from skate_env import IceSkateVectorEnv\n"
        "try:\n    IceSkateVectorEnv(20_000)\n"
        "except ValueError as error:\n    print(error)\n"
    )

    def limit():
        resource.setrlimit(resource.RLIMIT_AS, (2**31, 2**31))

    done = subprocess.run(
        [sys.executable, "-c", code], capture_output=True, text=True, preexec_fn=limit, check=True
    )
    assert "20000 environments take" in done.stdout


def test_elapsed_actions_do_not_wrap():
    env = IceSkateVectorEnv(2, max_episode_steps=10, autoreset_mode="Disabled")
    env.reset(seed=1, options={"elapsed": np.array([2**64 - 1, 0], np.uint64)})
    _, _, _, truncated, _ = env.step(np.zeros(env.action_space.shape, np.float32))
    assert truncated.tolist() == [True, False]
