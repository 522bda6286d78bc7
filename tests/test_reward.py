"""What the reward does not pay for: every exploit earns less than skating.

A test of the engine (`task/reward.rs`) has feet that slide under hips that move backward.
"""

import numpy as np
import pytest

from skate_env import IceSkateEnv, Policy, Simulator
from skate_env._core import REWARD_WEIGHTS
from skate_env.policies import baseline, shipped

SECONDS = 10.0
WEIGHTS = {name: default for name, _, default in REWARD_WEIGHTS}
# Slide at the high speed with an upright head.
MOST = SECONDS * (WEIGHTS["slide"] * WEIGHTS["high_speed"] + WEIGHTS["head"])
# Torque of a full action of all joints [N m].
SCALE = 100.0
SKATED = ["paper", "paper_printed", "push_only"]


def earned(env, act, velocity=None):
    """Rewards by term over an episode of at most 10 s, and the last info."""
    options = None if velocity is None else {"state": {"v": velocity}}
    observation, info = env.reset(seed=0, options=options)
    sums, over = dict.fromkeys((key for key in info if key.startswith("reward_")), 0.0), False
    while not over and info["time"] < SECONDS - 1e-9:
        observation, _, over, _, info = env.step(act(observation))
        sums = {key: value + info[key] for key, value in sums.items()}
    return {key.removeprefix("reward_"): value for key, value in sums.items()}, info


def total(env, act, velocity=None):
    return sum(earned(env, act, velocity)[0].values())


def zero(_):
    return np.zeros(10, np.float32)


@pytest.fixture(scope="module")
def skating():
    """Reward of the shipped policy by scene, of at most `MOST` in 10 s."""
    policies = {name: Policy.load(shipped(name)) for name in SKATED}
    return {
        name: total(IceSkateEnv(**policy.environment()), lambda seen, p=policy: p.predict(seen)[0])
        for name, policy in policies.items()
    }


def test_skating_is_paid_in_every_scene(skating):
    # Measured: 0.58, 0.57 and 0.54 of the most.
    assert all(0.3 * MOST < paid < MOST for paid in skating.values()), skating


@pytest.mark.parametrize("name", ["paper", "paper_printed"])
@pytest.mark.parametrize("factor", [1.0, 3.0])
def test_standing_and_gliding_without_steps(name, factor, skating):
    """Visual lifting without the printed torques glides and stands: it ends after 2 s."""
    scene = baseline.lifting_only(name).scene
    velocity = Simulator(scene).v
    velocity[0] *= factor
    terms, info = earned(IceSkateEnv(scene), zero, velocity)
    assert info["steps"] == 0 and info["termination"] == "no_step"
    assert WEIGHTS["longest_step"] < info["time"] < WEIGHTS["longest_step"] + 0.01 + 1e-9
    # Measured: -0.02, 0.06, 0.08 and -0.7 of it.
    assert sum(terms.values()) < 0.1 * skating[name]


def test_speeding():
    """Half as fast again slides half as far again, and is paid less."""
    velocity = Simulator("paper_printed").v
    velocity[0] *= 1.5
    usual, there = earned(IceSkateEnv("paper_printed"), zero)
    fast, here = earned(IceSkateEnv("paper_printed"), zero, velocity)
    assert here["loaded_slide"] > 1.4 * there["loaded_slide"]
    # Both make all of their steps upright. Measured: 33.2 and 36.3.
    assert here["termination"] is there["termination"] is None
    assert sum(fast.values()) < sum(usual.values())


def test_no_speed_is_paid_more_than_the_high_one():
    """The most, for any start: twice and three times as fast, forward and backward."""
    scene = baseline.lifting_only("paper_printed").scene
    for factor in (-3.0, -1.0, 1.0, 2.0, 3.0):
        velocity = Simulator(scene).v
        velocity[0] *= factor
        env = IceSkateEnv(scene, reward={"longest_step": 1e3})
        terms, info = earned(env, zero, velocity)
        assert info["termination"] is None
        assert sum(terms.values()) < MOST


def test_hopping(skating):
    """The controller of `push_only` is in the air for half of the time."""
    terms, info = earned(IceSkateEnv("push_only"), zero)
    assert info["flight_time"] > 0.5 * info["time"] and info["steps"] > 3
    assert terms["flight"] == pytest.approx(-WEIGHTS["flight"] * info["flight_time"], rel=1e-12)
    assert sum(terms.values()) < 0.0 < skating["push_only"]


def test_skating_backward():
    scene = baseline.lifting_only("paper_printed").scene
    velocity = Simulator(scene).v
    velocity[0] *= -1.0
    terms, info = earned(IceSkateEnv(scene), zero, velocity)
    assert info["loaded_slide"] < -1.0
    # It makes no step, so no slide is paid.
    assert terms["slide"] <= 0.0 and sum(terms.values()) < 0.0


@pytest.mark.parametrize("sign", [1.0, -1.0])
def test_diving(sign, skating):
    """A full torque in the trunk's pitch throws the robot forward or backward."""
    action = np.zeros(10, np.float32)
    action[7] = sign
    terms, info = earned(IceSkateEnv("push_only", action_scale=SCALE), lambda _: action)
    assert info["termination"] == "fall" and info["time"] < 1.0
    assert sum(terms.values()) < 0.0 < skating["push_only"]


def test_early_falls_and_random_actions(skating):
    for name in SKATED:
        env = IceSkateEnv(name, action_scale=SCALE)
        env.action_space.seed(0)
        terms, info = earned(env, lambda _, e=env: e.action_space.sample())
        assert info["termination"] in ("fall", "no_step")
        # Measured: -0.04, 0.15 and -0.14; `paper_printed` starts with 7.9 m/s.
        assert sum(terms.values()) < 0.2 * skating[name]
