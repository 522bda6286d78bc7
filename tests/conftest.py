"""Fixtures and helpers of several test files."""

import os
import warnings
from collections.abc import Callable
from importlib.util import find_spec
from typing import Any

import gymnasium
import numpy as np
import pytest

from skate_env import IceSkateEnv, Policy, Scene, load_scene
from skate_env.environments import TORQUE_SCALE
from skate_env.scenes import replace

# Windows of the tests are invisible; this works without a display as well.
os.environ["SDL_VIDEODRIVER"] = "dummy"

# Test files that need more than the extra `test`. The quick tier leaves out those whose library is
# not installed; `make test-all` sets SKATE_TESTS=all and collects every file.
NEEDS = {
    "test_any_ice_training.py": "stable_baselines3",
    "test_contact_sequence.py": "stable_baselines3",
    "test_bench.py": "pinocchio",
    "test_oracles.py": "pinocchio",
    "test_record.py": "imageio_ffmpeg",
    "test_render.py": "imageio_ffmpeg",
    "test_from_sb3.py": "stable_baselines3",
    "test_rllib.py": "ray",
    "test_sb3.py": "stable_baselines3",
    "test_training.py": "stable_baselines3",
    "test_training_smoke.py": "stable_baselines3",
    "test_zoo.py": "rl_zoo3",
}
collect_ignore = [
    name
    for name, library in NEEDS.items()
    if os.environ.get("SKATE_TESTS") != "all" and find_spec(library) is None
]


def pytest_configure() -> None:
    """Require the Gymnasium version that ``make test`` specifies."""
    asked, found = os.environ.get("GYMNASIUM", ""), gymnasium.__version__
    if not found.startswith(asked):
        raise pytest.UsageError(f"Gymnasium {asked} is to be tested, but this is {found}")


def pytest_collection_modifyitems(items: list[pytest.Item]) -> None:
    """Run the longest tests first, so that all workers finish at about the same time."""
    items.sort(key=lambda item: item.path.stem != "test_vector_bits")


@pytest.fixture(scope="session")
def paper() -> Callable[..., Scene]:
    """Preset `paper` with changes; its start omits the joints that they lock."""

    def make(**changes: Any) -> Scene:
        scene = load_scene("paper")
        locked = changes.get("locked", [])
        start = scene.get("start")
        for part in ("q", "v"):
            start[part] = {name: x for name, x in start[part].items() if name not in locked}
        return replace(scene, {"start": start, **changes})

    return make


@pytest.fixture(scope="session")
def random_policy() -> Callable[..., Policy]:
    """Random policies of a scene; `size` scales their actions."""

    def make(scene: Scene | str = "paper", size: float = 0.1, seed: int = 0) -> Policy:
        env = IceSkateEnv(scene, joints="all", mirrored=False)
        rng = np.random.default_rng(seed)
        d, n = len(env.observation_names), len(env.joint_names)
        layers = [
            (rng.normal(0.0, i**-0.5, (o, i)), rng.normal(0.0, 0.1, o))
            for i, o in ((d, 32), (32, 24), (24, n))
        ]
        layers[-1] = tuple(size * part for part in layers[-1])
        return Policy(
            scene=env.scene,
            layers=layers,
            log_std=np.full(n, -2.0),
            mean=rng.normal(0.0, 0.1, d),
            std=rng.uniform(0.5, 2.0, d),
            clip=10.0,
            action_scale={joint: TORQUE_SCALE[joint] for joint in env.joint_names},
            observation_names=env.observation_names,
            joint_names=env.joint_names,
            about={"seed": seed, "made": "at random"},
        )

    return make


@pytest.fixture(scope="session")
def refused() -> Callable[..., None]:
    """Expect an exception of exactly this type whose message contains all words, and no warning."""

    def expect(kind: type[Exception], call: Callable[[], Any], *words: str) -> None:
        with warnings.catch_warnings():
            warnings.simplefilter("error")
            with pytest.raises(kind) as refusal:
                call()
        assert type(refusal.value) is kind, repr(refusal.value)
        message = str(refusal.value)
        for word in words:
            assert word in message, (word, message)
        assert len(message) < 2000

    return expect
