"""``import skate_env`` registers the ids, and ``skate_env:IceSkate-v0`` imports it."""

import multiprocessing
import os
import subprocess
import sys
from pathlib import Path

import gymnasium
import pytest

from skate_env.registration import IDS, register

ID, *_ = IDS
ROOT = Path(__file__).parents[1]
MAKE = """
import sys, gymnasium
env = gymnasium.make("IceSkate-v0")
env.reset(seed=0)
env.step(env.action_space.sample())
envs = gymnasium.make_vec("IceSkate-v0", num_envs=2)
assert type(envs).__name__ == "IceSkateVectorEnv"
envs.reset(seed=0)
"""


def python(code, *options, **environment):
    """Run Python in a separate process without output; warnings are errors."""
    done = subprocess.run(
        [sys.executable, *options, "-W", "error", "-c", code],
        capture_output=True,
        text=True,
        timeout=120,
        env=os.environ | environment,
    )
    assert done.returncode == 0, done.stderr
    assert done.stderr == "", done.stderr


@pytest.mark.parametrize("first", ["import skate_env", "import gymnasium, skate_env"])
def test_bare_make_and_make_vec(first):
    python(first + MAKE)


def test_a_prefix_needs_no_import():
    python(MAKE.replace("IceSkate-v0", "skate_env:IceSkate-v0"))


def test_the_import_registers_what_is_missing():
    for name in IDS:
        del gymnasium.registry[name]
    for _ in range(2):
        register()
    assert gymnasium.spec(ID).vector_entry_point == "skate_env.environments:IceSkateVectorEnv"
    assert set(IDS) <= set(gymnasium.registry)


def test_the_page_says_from_which_return_a_task_is_solved():
    *first, last = (f"{gymnasium.spec(name).reward_threshold:g}" for name in IDS)
    text = (ROOT / "docs" / "iceskate-v0.md").read_text(encoding="utf-8")
    said = f"mean return of {', '.join(first)} and {last} over 100 episodes"
    assert said in " ".join(text.split())


def test_spawned_workers_make_the_environment():
    """Gymnasium's AsyncVectorEnv and Stable-Baselines3's SubprocVecEnv start such processes."""
    context = multiprocessing.get_context("spawn")
    with context.Pool(1) as pool:
        name = [pool.apply(gymnasium.make, (f"skate_env:{each}",)).spec.id for each in IDS]
    assert name == list(IDS)
