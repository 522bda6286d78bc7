"""The Gymnasium environment."""

import warnings

import gymnasium
import numpy as np
import pytest
from gymnasium.utils.env_checker import check_env

import skate_env
from skate_env.env import TORQUE_SCALE, IceSkateEnv
from skate_env.scenes import replace


@pytest.mark.parametrize("name", skate_env.scene_names())
def test_gymnasium_finds_nothing_to_say(name):
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        for perturb in (0.0, 0.01):
            env = gymnasium.make("skate_env:IceSkate-v0", scene=name, perturb=perturb)
            check_env(env.unwrapped)


def test_zero_action_is_the_replay_bit_for_bit():
    env = IceSkateEnv("paper")
    env.reset(seed=1)
    sim = skate_env.Simulator("paper")
    zero = np.zeros(env.action_space.shape, np.float32)
    for _ in range(300):
        env.step(zero)
        sim.step()
    assert sim.time > 2.9
    np.testing.assert_array_equal(env._sim.q, sim.q)
    np.testing.assert_array_equal(env._sim.v, sim.v)


def test_action_is_the_scale_times_a_held_torque():
    env = IceSkateEnv("paper")
    env.reset(seed=1)
    sim = skate_env.Simulator("paper")
    action = np.linspace(-0.1, 0.1, 16).astype(np.float32)
    env.step(action)
    sim.step(action.astype(float) * list(TORQUE_SCALE.values()))
    np.testing.assert_array_equal(env._sim.q, sim.q)


def test_scale_names_every_joint():
    assert list(TORQUE_SCALE) == skate_env.Simulator("paper").coordinate_names[3:]


def test_same_seed_same_episode_and_another_another():
    def episode(seed):
        env = IceSkateEnv("paper", perturb=0.01)
        observation, _ = env.reset(seed=seed)
        env.action_space.seed(seed)
        seen = [observation]
        for _ in range(20):
            seen.append(env.step(0.01 * env.action_space.sample())[0])
        return np.array(seen)

    np.testing.assert_array_equal(episode(5), episode(5))
    assert not np.array_equal(episode(5), episode(6))


def test_second_reset_without_a_seed_draws_a_new_start():
    env = IceSkateEnv("paper", perturb=0.01)
    first, _ = env.reset(seed=5)
    second, _ = env.reset()
    assert not np.array_equal(first, second)


def test_reward_is_the_sum_of_its_named_terms_and_slide_is_what_pays():
    env = IceSkateEnv("paper")
    env.reset()
    slide = 0.0
    zero = np.zeros(env.action_space.shape, np.float32)
    for _ in range(300):
        _, reward, _, _, info = env.step(zero)
        terms = [value for key, value in info.items() if key.startswith("reward_")]
        assert reward == pytest.approx(sum(terms), abs=1e-15)
        assert info["reward_effort"] == 0.0
        slide += info["reward_slide"]
    # The rectangle rule over 10 ms against the slide that the engine integrates.
    sim = skate_env.Simulator("paper")
    for _ in range(300):
        sim.step()
    steps = sim.take_steps()
    slid = sum(step["slide"] for step in steps)
    assert slide == pytest.approx(slid * sim.time / steps[-1]["time"], rel=0.25)


def test_effort_costs():
    env = IceSkateEnv("paper")
    env.reset()
    info = env.step(np.ones(env.action_space.shape, np.float32))[-1]
    assert info["reward_effort"] == pytest.approx(-0.1 * env._sim.action_period)


def test_fall_terminates_and_says_so():
    env = IceSkateEnv(replace(skate_env.load_scene("paper"), {"fall.head_height": 2.9}))
    env.reset()
    _, _, terminated, truncated, info = env.step(np.zeros(16, np.float32))
    assert terminated is True and truncated is False
    assert info["end_cause"] == "fall"


def test_only_the_time_limit_truncates():
    env = gymnasium.make("IceSkate-v0", max_episode_steps=4)
    env.reset()
    zero = np.zeros(16, np.float32)
    ends = [env.step(zero)[2:4] for _ in range(4)]
    assert ends == [(False, False)] * 3 + [(False, True)]
    assert gymnasium.spec("IceSkate-v0").max_episode_steps == 3000


def test_observations_stay_inside_the_space_under_full_random_actions():
    env = IceSkateEnv("paper")
    env.action_space.seed(0)
    for _ in range(20):
        observation, _ = env.reset()
        for _ in range(200):
            assert env.observation_space.contains(observation)
            observation, _, terminated, _, info = env.step(env.action_space.sample())
            if terminated:
                assert info["end_cause"]
                break
        assert env.observation_space.contains(observation)


def test_locked_joints_leave_the_action_space():
    scene = skate_env.load_scene("paper")
    start = {f"start.{x}.{joint}": 0.0 for x in "qv" for joint in ("q10", "q17")}
    env = IceSkateEnv(replace(scene, {"locked": ["q10", "q17"], **start}))
    observation, _ = env.reset()
    assert env.action_space.shape == (14,)
    assert env.observation_space.contains(observation)
