"""Invalid actions and arguments of the environment are refused by name; nothing changes."""

import functools
import math

import numpy as np
import pytest
from gymnasium.error import ClosedEnvironmentError, ResetNeeded

from skate_env.environments import IceSkateEnv, IceSkateVectorEnv

WRONG_ACTIONS = {
    "nan": (ValueError, [*[0.0] * 9, np.nan], ["action[9] = nan", "finite"]),
    "inf": (ValueError, np.float32([*[0.0] * 9, -np.inf]), ["action[9] = -inf", "finite"]),
    "one number": (ValueError, 0.5, ["action has shape (): must be (10,)"]),
    "one": (ValueError, [0.5], ["action has shape (1,): must be (10,)"]),
    "row": (ValueError, np.zeros((1, 10)), ["action has shape (1, 10): must be (10,)"]),
    "short": (ValueError, np.zeros(9), ["action has shape (9,): must be (10,)"]),
    "ragged": (ValueError, [[0.0], [0.0, 1.0]], ["action: not an array of 10 numbers"]),
    "none": (TypeError, None, ["action has dtype object: must be 10 real numbers"]),
    "text": (TypeError, "abc", ["action has dtype", "must be 10 real numbers"]),
    "complex": (TypeError, np.zeros(10, complex), ["action has dtype complex128"]),
    "bool": (TypeError, np.zeros(10, bool), ["action has dtype bool"]),
}


@pytest.mark.parametrize("wrong", WRONG_ACTIONS)
def test_wrong_actions_are_refused(refused, wrong):
    kind, action, words = WRONG_ACTIONS[wrong]
    env = IceSkateEnv("paper")
    env.reset(seed=0)
    env.step(np.full(10, 0.1))
    before = env.snapshot()
    refused(kind, lambda: env.step(action), *words)
    assert env.snapshot() == before


def frozen(x):
    copy = x.copy()
    copy.flags.writeable = False
    return copy


SAME = {
    "float64": lambda x: x.astype(float),
    "list": lambda x: x.tolist(),
    "strided": lambda x: np.repeat(x, 2, axis=-1)[..., ::2],
    "column after column": np.asfortranarray,
    "big-endian": lambda x: x.astype(">f4"),
    "long double": lambda x: x.astype(np.longdouble),
    "not aligned": lambda x: (
        np.frombuffer(b"." + x.tobytes(), np.uint8)[1:].view(np.float32).reshape(x.shape)
    ),
    "not to be written": frozen,
}


@pytest.mark.parametrize("form", SAME)
@pytest.mark.parametrize("make", [IceSkateEnv, functools.partial(IceSkateVectorEnv, 3)])
def test_actions_of_any_form_mean_the_same(make, form):
    envs = [make(scene="paper"), make(scene="paper")]
    shape = envs[0].action_space.shape
    actions = np.linspace(-1.2, 1.1, np.prod(shape), dtype=np.float32).reshape(shape)
    for env, given in zip(envs, (actions, SAME[form](actions)), strict=True):
        env.reset(seed=0)
        env.step(given)
    assert envs[0].snapshot() == envs[1].snapshot()


def test_a_batch_of_several_has_no_step_of_one(refused):
    batch = IceSkateVectorEnv(3, "paper")._batch
    refused(ValueError, lambda: batch.step_alone(np.zeros(10)), "3 environments")


def test_actions_beyond_the_space_count_as_its_bounds():
    envs = [IceSkateEnv("paper"), IceSkateEnv("paper")]
    for env, size in zip(envs, (1.0, 1e300), strict=True):
        env.reset(seed=0)
        env.step(np.full(10, size))
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
        ({"trunk_noise": -0.1}, ValueError, ["trunk_noise = -0.1", "must lie in [0, 1]"]),
        ({"trunk_noise": 1.1}, ValueError, ["trunk_noise = 1.1", "must lie in [0, 1]"]),
        ({"trunk_noise": math.nan}, ValueError, ["trunk_noise = NaN", "must lie in [0, 1]"]),
        ({"trunk_noise": "0.1"}, TypeError, ["trunk_noise = '0.1'", "real number, not str"]),
        ({"kick": -0.1}, ValueError, ["kick = -0.1", "must lie in [0, 10] m/s"]),
        ({"kick": 10.1}, ValueError, ["kick = 10.1", "must lie in [0, 10] m/s"]),
        ({"kick": math.nan}, ValueError, ["kick = NaN", "must lie in [0, 10] m/s"]),
        ({"kick": None}, TypeError, ["kick = None", "real number, not NoneType"]),
        ({"scene": "nope"}, ValueError, ["no scene 'nope'", "paper"]),
        ({"scene": None}, TypeError, ["scene None", "not NoneType"]),
        ({"scene": 3}, TypeError, ["scene 3", "not int"]),
        ({"reward": {"head": 10**400}}, ValueError, ["reward['head']", "too large"]),
        ({"action_period": 0.0}, ValueError, ["control.action_period = 0", "[0.0001, 1] s"]),
        ({"action_period": "1"}, TypeError, ["action_period = '1'", "real number, not str"]),
        ({"action_scale": {"q1": 1.0}}, ValueError, ["'q1'", "q2, q3, q4"]),
        ({"action_scale": {"q2": -1.0}}, ValueError, ["action_scale[q2] = -1", "[0, 1000000]"]),
        ({"action_scale": math.nan}, ValueError, ["action_scale[q2] = NaN"]),
        ({"action_scale": [1.0] * 10}, TypeError, ["action_scale", "real number, not list"]),
        ({"torque_limit": -1.0}, ValueError, ["torque_limit = -1", "at least 0 N m"]),
        ({"torque_limit": math.nan}, ValueError, ["torque_limit = NaN"]),
        ({"reward": {"slide": math.inf}}, ValueError, ["reward[slide] = inf", "1/m"]),
        ({"reward": {"high_speed": -1.0}}, ValueError, ["reward[high_speed] = -1", "m/s"]),
        ({"reward": {"longest_step": -1.0}}, ValueError, ["reward[longest_step] = -1", " s"]),
        ({"reward": {"longest_step": math.nan}}, ValueError, ["reward[longest_step] = NaN"]),
        ({"reward": {"head": None}}, TypeError, ["reward['head'] = None"]),
        ({"reward": {"flight": "0"}}, TypeError, ["reward['flight'] = '0'"]),
        ({"reward": {"posture": 1.0}}, ValueError, ['"posture"', "slide, head, flight, speed"]),
        # A term of earlier versions.
        ({"reward": {"effort": 0.1}}, ValueError, ['"effort"', "fall, high_speed, longest_step"]),
        ({"reward": 1.0}, TypeError, ["reward = 1.0", "a dict"]),
        ({"joints": "legs"}, ValueError, ["joints = 'legs'", '"all" or a list']),
        ({"joints": 3}, TypeError, ["joints = 3", '"all" or a list']),
        ({"joints": []}, ValueError, ["joints", "at least one"]),
        ({"joints": ["q2", "q1"]}, ValueError, ['joints: "q1"', "q2, q3, q4", "each once"]),
        ({"joints": ["q2", "q2"]}, ValueError, ['joints: "q2"', "each once"]),
        ({"mirrored": 1}, TypeError, ["mirrored = 1", "True or False"]),
        ({"action_scale": {"q11": 1.0}}, ValueError, ["'q11'", "q2, q3, q4"]),
        ({"render_mode": "ascii"}, ValueError, ["render_mode", "'ascii'", "rgb_array"]),
        ({"weights": 1.0}, TypeError, ["unexpected keyword argument 'weights'"]),
        ({"accuracy": "sloppy"}, ValueError, ["accuracy", "fast, balanced, reference"]),
        ({"accuracy": 1.0}, ValueError, ["accuracy = 1: must lie in [1e-13, 0.01]"]),
        ({"accuracy": math.nan}, ValueError, ["accuracy = nan", "finite"]),
        ({"accuracy": {"method": "euler"}}, ValueError, ["accuracy"]),
        ({"accuracy": np.zeros(2)}, TypeError, ["accuracy = array"]),
    ],
)
def test_wrong_environments_are_refused(refused, arguments, kind, words):
    refused(kind, lambda: IceSkateEnv(**arguments), *words)


def test_a_step_before_the_reset_and_after_the_end_is_refused(refused):
    env = IceSkateEnv("push_only")
    refused(ResetNeeded, lambda: env.step(np.zeros(10)), "has not been reset", "call reset")
    refused(ResetNeeded, IceSkateEnv(render_mode="rgb_array").render, "before reset")
    env.reset(seed=0)
    while not env.step(np.zeros(10))[2]:
        pass
    before = env.snapshot()
    refused(ResetNeeded, lambda: env.step(np.zeros(10)), "its episode is over", "call reset")
    assert env.snapshot() == before


def test_a_closed_environment_raises(refused):
    env = IceSkateEnv(render_mode="rgb_array")
    env.reset(seed=0)
    saved = env.snapshot()
    env.close()
    env.close()
    for call in (env.reset, env.render, lambda: env.step(np.zeros(10)), lambda: env.restore(saved)):
        refused(ClosedEnvironmentError, call, "closed", "make a new one")
