"""Environment i of ``make_vec(seed=s)`` is ``make(seed=s + i)``, bit for bit.

10,000 steps of each of 64 environments with random ice, masses and gains, disturbed starts, falls,
robots without steps and time limits; every observation, reward, end and info goes into a digest per
environment.
"""

import functools
import hashlib
import itertools
import json
import subprocess
import sys
from pathlib import Path

import gymnasium
import numpy as np
import pytest
from gymnasium.vector import AutoresetMode

from skate_env import load_scene
from skate_env._core import TERMINATIONS
from skate_env.scenes import replace

NAMED = ("support_leg", "termination")
KEYS = (
    "time",
    "state_number",
    "steps",
    "flight_time",
    "double_support_time",
    "y_position",
    "reward_slide",
    "reward_head",
    "reward_flight",
    "reward_speed",
    "reward_fall",
)
CODES = {cause: i for i, cause in enumerate([None, *TERMINATIONS])}
# Reward, terminated and truncated of a step that resets.
NOTHING = (0.0, False, False)
STEPS, MOST, LIMIT, SEED = 10_000, 64, 150, 20
MODES = {mode.value: mode for mode in AutoresetMode}


@functools.cache
def scene():
    ranges = {
        "ice.friction.mu_forward": [0.1, 0.3],
        "body.head.mass": [4.0, 5.0],
        "body.upper_leg.length": [0.37, 0.39],
        # With a tenth of its own value a robot falls at once.
        "control.lifting.K_p.2": [5e3, 6e4],
    }
    return replace(load_scene("paper"), {"randomise": ranges, "accuracy": "fast"})


KEYWORDS = {
    "perturb": 0.02,
    "action_period": 0.01,
    "action_scale": 100.0,
    "reward": {"longest_step": 0.6},
    "max_episode_steps": LIMIT,
}


@functools.cache
def all_actions():
    """Actions of all environments (T, n, 10), some of which make the robot fall."""
    rng = np.random.default_rng(1)
    size = rng.choice([0.0, 0.05, 0.3], MOST)[:, None]
    actions = rng.uniform(-1.0, 1.0, (STEPS, MOST, 10)) * size
    return actions.astype(np.float32)


def numbers(observation, rest, info):
    """All results of a step as float64, which represents each of them exactly."""
    legs = np.where(np.asarray(info["support_leg"]) == "right", 1.0, -1.0)
    ends = np.vectorize(CODES.get, otypes=[float])(info["termination"])
    columns = [*rest, legs, ends, *(info[key] for key in KEYS)]
    return np.column_stack([np.atleast_2d(observation), *map(np.atleast_1d, columns)])


def row(observation, rest, info):
    """Return the same for one environment, faster."""
    leg = 1.0 if info["support_leg"] == "right" else -1.0
    others = [info[key] for key in KEYS]
    return np.array([*observation.tolist(), *rest, leg, CODES[info["termination"]], *others])[None]


class Digests:
    """Digests of the results of n environments: rows of all steps, final results of episodes."""

    def __init__(self, n):
        self._hashes = [hashlib.blake2b(digest_size=16) for _ in range(n)]
        self._finals = [hashlib.blake2b(digest_size=16) for _ in range(n)]
        self._rows = []

    def add(self, rows):
        """Add the rows of a step (n, k)."""
        self._rows.append(rows)
        if len(self._rows) == 500:
            self._flush()

    def one(self, i, row):
        """Add the row of a reset of one environment, at this place of its sequence."""
        self._flush()
        self._hashes[i].update(row.tobytes())

    def final(self, i, row):
        """Add the final result of an episode."""
        self._finals[i].update(row.tobytes())

    def _flush(self):
        if self._rows:
            block = np.array(self._rows)
            for i, digest in enumerate(self._hashes):
                digest.update(block[:, i].tobytes())
            self._rows = []

    def hex(self):
        """Both digests of each environment."""
        self._flush()
        pairs = zip(self._hashes, self._finals, strict=True)
        return [rows.hexdigest() + finals.hexdigest() for rows, finals in pairs]


def singles(modes, i):
    """Digests of `make(seed=SEED + i)`, reset as in each mode, and causes of all ends.

    `SameStep` and `Disabled` give the same sequence: in both of them every action moves the robot.
    """
    env = gymnasium.make("IceSkate-v0", scene=scene(), **KEYWORDS)
    digests, ends = {mode: Digests(1) for mode in modes}, []
    observation, info = env.reset(seed=SEED + i)
    for each in digests.values():
        each.add(row(observation, NOTHING, info))
    over = False
    for action in all_actions()[:, i]:
        if over and "NextStep" in modes:
            observation, info = env.reset()
            digests["NextStep"].add(row(observation, NOTHING, info))
            over = False
            continue
        observation, *rest, info = env.step(action)
        made = row(observation, rest, info)
        over = rest[1] or rest[2]
        ends += [info["termination"]] * over
        if not over or "NextStep" in modes:
            for each in digests.values():
                each.add(made)
            continue
        final = row(observation, (), info)
        observation, info = env.reset()
        if "SameStep" in modes:
            digests["SameStep"].final(0, final)
            digests["SameStep"].add(row(observation, rest, info))
        if "Disabled" in modes:
            digests["Disabled"].add(made)
            digests["Disabled"].one(0, row(observation, (), info))
    return {mode: each.hex()[0] for mode, each in digests.items()}, ends


def vector(mode, n, threads):
    """Return digests of the environments of `make_vec(seed=SEED)`."""
    env = gymnasium.make_vec(
        "IceSkate-v0",
        n,
        scene=scene(),
        num_threads=threads,
        autoreset_mode=MODES[mode],
        **KEYWORDS,
    )
    digests = Digests(n)
    observations, info = env.reset(seed=SEED)
    digests.add(numbers(observations, [np.full(n, x) for x in NOTHING], info))
    for actions in all_actions()[:, :n]:
        observations, *rest, info = env.step(actions)
        over = rest[1] | rest[2]
        digests.add(numbers(observations, rest, info))
        if mode == "SameStep" and over.any():
            np.testing.assert_array_equal(info["_final_obs"], over)
            for i in np.flatnonzero(over):
                final = {key: info["final_info"][key][i] for key in (*KEYS, *NAMED)}
                digests.final(i, row(info["final_obs"][i], (), final))
        if mode == "Disabled" and over.any():
            observations, info = env.reset(options={"reset_mask": over})
            for i in np.flatnonzero(over):
                begun = {key: info[key][i] for key in (*KEYS, *NAMED)}
                digests.one(i, row(observations[i], (), begun))
    return digests.hex()


def check(mode, wanted, sizes):
    """Compare several batch sizes and numbers of threads, and a separate process."""
    for n, threads in sizes:
        assert vector(mode, n, threads) == wanted[:n], (mode, n, threads)
    # A separate process.
    code = (
        f"import sys, json; sys.path.insert(0, {str(Path(__file__).parent)!r});"
        f"import test_vector_bits as bits; print(json.dumps(bits.vector({mode!r}, 7, 2)))"
    )
    other = subprocess.run([sys.executable, "-c", code], capture_output=True, check=True, text=True)
    assert json.loads(other.stdout) == wanted[:7], mode


# Size and threads are independent of the reset mode: all pairs with one mode.
@pytest.mark.long("10,000 steps of 64 environments are bit-identical to single ones")
@pytest.mark.parametrize(
    "sizes",
    [
        {"NextStep": list(itertools.product((1, 7, MOST), (1, 2, 4)))},
        {mode: [(1, 4), (7, 1), (MOST, 2)] for mode in ("SameStep", "Disabled")},
    ],
    ids="-".join,
)
def test_every_environment_of_a_vector_is_the_single_one(sizes):
    walks, ends = zip(*(singles(sizes, i) for i in range(MOST)), strict=True)
    assert min(map(len, ends)) > STEPS // LIMIT // 2
    # None is the time limit.
    assert {"fall", "no_step", None} <= {cause for each in ends for cause in each}
    for mode, pairs in sizes.items():
        wanted = [walk[mode] for walk in walks]
        assert len(set(wanted)) == MOST
        check(mode, wanted, pairs)
