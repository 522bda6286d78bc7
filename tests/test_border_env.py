"""Wrong actions and arguments of the environment: refused by name, and nothing has changed."""

import math

import numpy as np
import pytest

from skate_env.env import IceSkateEnv

WRONG_ACTIONS = {
    "nan": (ValueError, [*[0.0] * 15, np.nan], ["action[15] = nan", "finite"]),
    "inf": (ValueError, np.float32([*[0.0] * 15, -np.inf]), ["action[15] = -inf", "finite"]),
    "one number": (ValueError, 0.5, ["action has shape (): must be (16,)"]),
    "one": (ValueError, [0.5], ["action has shape (1,): must be (16,)"]),
    "row": (ValueError, np.zeros((1, 16)), ["action has shape (1, 16): must be (16,)"]),
    "short": (ValueError, np.zeros(15), ["action has shape (15,): must be (16,)"]),
    "ragged": (ValueError, [[0.0], [0.0, 1.0]], ["action: not an array of numbers"]),
    "none": (TypeError, None, ["action has dtype object: must be 16 real numbers"]),
    "text": (TypeError, "abc", ["action has dtype", "must be 16 real numbers"]),
    "complex": (TypeError, np.zeros(16, complex), ["action has dtype complex128"]),
    "bool": (TypeError, np.zeros(16, bool), ["action has dtype bool"]),
}


@pytest.mark.parametrize("wrong", WRONG_ACTIONS)
def test_wrong_actions_are_refused(refused, wrong):
    kind, action, words = WRONG_ACTIONS[wrong]
    env = IceSkateEnv("paper")
    env.reset(seed=0)
    env.step(np.full(16, 0.1))
    before = env.snapshot()
    refused(kind, lambda: env.step(action), *words)
    assert env.snapshot() == before


def test_actions_beyond_the_space_count_as_its_bounds():
    envs = [IceSkateEnv("paper"), IceSkateEnv("paper")]
    for env, size in zip(envs, (1.0, 1e300), strict=True):
        env.reset(seed=0)
        env.step(np.full(16, size))
    assert envs[0].snapshot() == envs[1].snapshot()


@pytest.mark.parametrize(
    ("arguments", "kind", "words"),
    [
        ({"perturb": -0.1}, ValueError, ["perturb = -0.1", "must lie in [0, 10]"]),
        ({"perturb": math.nan}, ValueError, ["perturb = NaN", "must lie in [0, 10]"]),
        ({"perturb": math.inf}, ValueError, ["perturb = inf", "must lie in [0, 10]"]),
        ({"perturb": "0.1"}, TypeError, ["perturb = '0.1'", "real number, not str"]),
        ({"perturb": None}, TypeError, ["perturb = None", "real number, not NoneType"]),
        ({"perturb": True}, TypeError, ["perturb = True", "real number, not bool"]),
        ({"scene": "nope"}, ValueError, ["no scene 'nope'", "paper"]),
        ({"scene": None}, TypeError, ["scene None", "not NoneType"]),
        ({"scene": 3}, TypeError, ["scene 3", "not int"]),
        ({"accuracy": "sloppy"}, ValueError, ["accuracy", "fast, balanced, reference"]),
        ({"accuracy": 1.0}, ValueError, ["accuracy = 1: must lie in [1e-13, 0.01]"]),
        ({"accuracy": math.nan}, ValueError, ["accuracy = nan", "finite"]),
        ({"accuracy": {"method": "euler"}}, ValueError, ["accuracy"]),
        ({"accuracy": np.zeros(2)}, TypeError, ["accuracy = array"]),
    ],
)
def test_wrong_environments_are_refused(refused, arguments, kind, words):
    refused(kind, lambda: IceSkateEnv(**arguments), *words)
