"""Environment i of ``make_vec(seed=s)`` is ``make(seed=s + i)``, bit for bit.

10,000 steps of each of 64 environments with random ice, masses and gains, disturbed starts, falls
and time limits; every observation, reward, end and info goes into a digest per environment.
"""

import functools
import hashlib
import json
import subprocess
import sys
from pathlib import Path

import gymnasium
import numpy as np
import pytest
from gymnasium.vector import AutoresetMode

from skate_env import load_scene
from skate_env.scenes import replace

STEPS, MOST, LIMIT, SEED = 10_000, 64, 150, 20
MODES = {mode.value: mode for mode in AutoresetMode}


@functools.cache
def scene():
    ranges = {
        "ice.friction.mu_forward": [0.1, 0.3],
        "body.head.mass": [4.0, 5.0],
        "body.upper_leg.length": [0.37, 0.39],
        "control.lifting.K_p.2": [5000.0, 6000.0],
    }
    return replace(load_scene("paper"), {"randomise": ranges, "accuracy": "fast"})


KEYWORDS = {"perturb": 0.02, "max_episode_steps": LIMIT}


@functools.cache
def all_actions():
    """Actions of all environments (T, n, 16), some of which make the robot fall."""
    rng = np.random.default_rng(1)
    size = rng.choice([0.0, 0.05, 0.3], MOST)[:, None]
    actions = rng.uniform(-1.0, 1.0, (STEPS, MOST, 16)) * size
    return actions.astype(np.float32)


class Digest:
    """Of everything that one environment gives out."""

    def __init__(self):
        self._hash = hashlib.blake2b(digest_size=16)
        self.ends = 0

    def add(self, observation, rest, info):
        self._hash.update(observation.tobytes())
        # Numbers to the last bit: repr gives them back exactly.
        self._hash.update(repr((rest, sorted(info.items()))).encode())
        self.ends += any(rest[1:])

    def hex(self):
        return self._hash.hexdigest()


def single(mode, i):
    """Digest of `make(seed=SEED + i)`, reset as the mode does it."""
    env = gymnasium.make("IceSkate-v0", scene=scene(), **KEYWORDS)
    digest = Digest()
    digest.add(*_begun(env.reset(seed=SEED + i)))
    over = False
    for action in all_actions()[:, i]:
        if over and mode == "NextStep":
            observation, info = env.reset()
            digest.add(observation, (0.0, False, False), info)
            over = False
            continue
        observation, *rest, info = env.step(action)
        over = rest[1] or rest[2]
        if over and mode == "SameStep":
            digest.add(observation, ("final",), info)
            observation, info = env.reset()
        digest.add(observation, tuple(rest), info)
        if over and mode == "Disabled":
            digest.add(*_begun(env.reset()))
    return digest.hex(), digest.ends


def vector(mode, n, threads):
    """Digests of the environments of `make_vec(seed=SEED)`."""
    env = gymnasium.make_vec(
        "IceSkate-v0",
        n,
        scene=scene(),
        num_threads=threads,
        autoreset_mode=MODES[mode],
        **KEYWORDS,
    )
    digests = [Digest() for _ in range(n)]
    observations, info = env.reset(seed=SEED)
    for i in range(n):
        digests[i].add(*_begun((observations[i], _row(info, i))))
    for actions in all_actions()[:, :n]:
        observations, rewards, terminated, truncated, info = env.step(actions)
        final = info.pop("final_info", {})
        columns = _columns(info)
        for i in range(n):
            if final and info["_final_obs"][i]:
                digests[i].add(info["final_obs"][i], ("final",), _row(final, i))
            rest = (rewards[i].item(), terminated[i].item(), truncated[i].item())
            digests[i].add(observations[i], rest, {key: x[i] for key, x in columns.items()})
        over = terminated | truncated
        if mode == "Disabled" and over.any():
            observations, info = env.reset(options={"reset_mask": over})
            for i in np.flatnonzero(over):
                digests[i].add(*_begun((observations[i], _row(info, i))))
    return [digest.hex() for digest in digests]


def _begun(reset):
    observation, info = reset
    return observation, (), info


def _columns(info):
    """Infos as lists of plain values."""
    keys = [key for key in info if not key.startswith("_") and key != "final_obs"]
    return {key: info[key].tolist() for key in keys}


def _row(info, i):
    return {key: column[i] for key, column in _columns(info).items()}


@pytest.mark.parametrize("mode", MODES)
def test_every_environment_of_a_vector_is_the_single_one(mode):
    wanted, ends = zip(*(single(mode, i) for i in range(MOST)), strict=True)
    assert len(set(wanted)) == MOST and min(ends) > STEPS // LIMIT // 2
    for n in (1, 7, MOST):
        for threads in (1, 2, 4):
            assert vector(mode, n, threads) == list(wanted[:n]), (n, threads)
    # And in another process, which shares nothing with this one.
    code = (
        f"import sys, json; sys.path.insert(0, {str(Path(__file__).parent)!r});"
        f"import test_vector_bits as bits; print(json.dumps(bits.vector({mode!r}, 7, 2)))"
    )
    other = subprocess.run([sys.executable, "-c", code], capture_output=True, check=True, text=True)
    assert json.loads(other.stdout) == list(wanted[:7])
