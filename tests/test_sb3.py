"""IceSkate-v0 for Stable-Baselines3, compared with the library's vector of environments."""

import warnings

import gymnasium
import numpy as np
import pytest
import torch
from stable_baselines3 import PPO
from stable_baselines3.common.env_checker import check_env
from stable_baselines3.common.evaluation import evaluate_policy
from stable_baselines3.common.vec_env import DummyVecEnv, VecMonitor, VecNormalize

import skate_env
from skate_env.environments import IceSkateEnv
from skate_env.sb3 import IceSkateVecEnv
from skate_env.scenes import replace


@pytest.fixture(autouse=True)
def _one_thread():
    torch.set_num_threads(1)


def falls_at_once():
    return replace(skate_env.load_scene("paper"), {"fall.head_height": 2.9})


@pytest.mark.parametrize("name", skate_env.scene_names())
def test_the_checker_of_the_library_passes(name):
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        check_env(IceSkateEnv(name, perturb=0.01))


def test_batch_equals_single_environments_bit_for_bit():
    keywords = {"scene": "push_only", "perturb": 0.01, "max_episode_steps": 80}
    keywords |= {"action_period": 0.01, "action_scale": 100.0}
    batch = IceSkateVecEnv(3, **keywords)
    single = DummyVecEnv([lambda: gymnasium.make("IceSkate-v0", **keywords)] * 3)
    assert batch.seed(7) == single.seed(7) == [7, 8, 9]
    np.testing.assert_array_equal(batch.reset(), single.reset())
    assert batch.reset_infos == single.reset_infos
    actions = np.random.default_rng(0).uniform(-1.0, 1.0, (300, 3, 10)).astype(np.float32)
    ends = []
    for action in actions:
        observations, rewards, dones, infos = batch.step(action)
        expected = single.step(action)
        for got, want in zip((observations, rewards, dones), expected, strict=False):
            assert got.dtype == want.dtype
            np.testing.assert_array_equal(got, want)
        assert batch.reset_infos == single.reset_infos
        for got, want in zip(infos, expected[3], strict=True):
            last, expected_last = (
                got.pop("terminal_observation", None),
                want.pop("terminal_observation", None),
            )
            np.testing.assert_array_equal(last, expected_last)
            assert got == want
            assert {key: type(x) for key, x in got.items()} == {
                key: type(x) for key, x in want.items()
            }
        ends += [info["TimeLimit.truncated"] for info in np.array(infos)[dones]]
    # Both kinds of ends occur.
    assert set(ends) == {True, False}


def test_infos_are_copies():
    batch = IceSkateVecEnv(2)
    batch.reset()
    first = batch.step(np.zeros((2, 10), np.float32))[3]
    before = [dict(info) for info in first]
    second = batch.step(np.zeros((2, 10), np.float32))[3]
    assert first == before
    assert second[0]["time"] > first[0]["time"]
    second[0]["time"] = -1.0
    assert batch.step(np.zeros((2, 10), np.float32))[3][0]["time"] > 0.0


def test_a_fall_at_the_time_limit_is_no_truncation():
    batch = IceSkateVecEnv(2, scene=falls_at_once(), max_episode_steps=1)
    batch.reset()
    _, _, dones, infos = batch.step(np.zeros((2, 10), np.float32))
    assert dones.tolist() == [True, True]
    assert [info["TimeLimit.truncated"] for info in infos] == [False, False]
    assert [info["termination"] for info in infos] == ["fall", "fall"]


@pytest.mark.parametrize("stagger", [False, True])
def test_staggering_spreads_the_time_limits_evenly(stagger):
    batch = IceSkateVecEnv(4, stagger=stagger, max_episode_steps=20)
    batch.reset()
    limits = [[], [], [], []]
    for step in range(1, 41):
        _, _, _, infos = batch.step(np.zeros((4, 10), np.float32))
        for i, info in enumerate(infos):
            if info["TimeLimit.truncated"]:
                limits[i].append(step)
    if stagger:
        assert limits == [[20, 40], [15, 35], [10, 30], [5, 25]]
    else:
        assert limits == [[20, 40]] * 4


def test_a_seed_counts_for_one_reset():
    batch = IceSkateVecEnv(2, perturb=0.01)
    batch.seed(5)
    first, second = batch.reset(), batch.reset()
    assert not np.array_equal(first, second)
    batch.seed(5)
    np.testing.assert_array_equal(batch.reset(), first)


def test_environment_methods_take_indices(refused):
    batch = IceSkateVecEnv(3)
    batch.reset()
    actions = np.zeros((3, 10), np.float32)
    actions[2] = 0.3
    batch.step(actions)
    simulators = batch.env_method("simulator", indices=[0, 2])
    assert [sim.time for sim in simulators] == [pytest.approx(0.01)] * 2
    assert not np.array_equal(simulators[0].q, simulators[1].q)
    assert batch.get_attr("num_envs", indices=1) == [3]
    assert batch.has_attr("render_mode") and not batch.has_attr("gravity")
    assert batch.env_is_wrapped(gymnasium.Wrapper) == [False] * 3
    assert batch.get_images() == [None] * 3
    refused(AttributeError, lambda: batch.set_attr("gravity", 9.8), "gravity", "batch")
    refused(TypeError, lambda: batch.set_options([{}, {}, {}]), "options", "one dict")


def test_a_saved_run_is_loaded_and_skates_the_same_bit_for_bit(tmp_path):
    keywords = {"perturb": 0.01, "max_episode_steps": 100}
    venv = VecNormalize(VecMonitor(IceSkateVecEnv(4, stagger=True, **keywords)))
    model = PPO("MlpPolicy", venv, n_steps=64, batch_size=64, n_epochs=2, seed=3, device="cpu")
    model.learn(512)
    # VecMonitor has complete episodes, VecNormalize has every observation.
    assert model.ep_info_buffer and venv.obs_rms.count > 512
    model.save(tmp_path / "model.zip")
    venv.save(str(tmp_path / "normaliser.pkl"))

    def evaluate(model, env):
        env.training = env.norm_reward = False
        env.seed(11)
        observations = env.reset()
        seen, done = [], np.zeros(2, bool)
        while not done.any():
            actions = model.predict(observations, deterministic=True)[0]
            observations, rewards, done, _ = env.step(actions)
            seen.append(np.column_stack([actions, observations, rewards]))
        return np.array(seen), evaluate_policy(model, env, 3, return_episode_rewards=True)[1]

    def fresh():
        return VecMonitor(IceSkateVecEnv(2, **keywords))

    kept = VecNormalize(fresh())
    kept.obs_rms = venv.obs_rms
    steps, lengths = evaluate(model, kept)
    loaded = PPO.load(tmp_path / "model.zip", device="cpu")
    normaliser = VecNormalize.load(str(tmp_path / "normaliser.pkl"), fresh())
    steps_again, lengths_again = evaluate(loaded, normaliser)
    assert len(steps) > 10
    np.testing.assert_array_equal(steps, steps_again)
    assert lengths == lengths_again


def test_no_time_limit_and_the_longest_one(refused):
    for none in (None, -1):
        assert IceSkateVecEnv(2, max_episode_steps=none).reset().shape[0] == 2
        refused(
            ValueError,
            lambda none=none: IceSkateVecEnv(2, max_episode_steps=none, stagger=True),
            "stagger = True",
            "max_episode_steps",
        )
    IceSkateVecEnv(4, max_episode_steps=2**63 - 1, stagger=True).reset()


def test_a_refused_seed_or_option_does_not_stay(refused):
    env = IceSkateVecEnv(2)
    env.seed(2**64 - 1)
    refused(ValueError, env.reset, "seed")
    env.reset()
    env.set_options({"x": 1})
    refused(ValueError, env.reset, "unknown option 'x'")
    env.reset()


def test_films_play_at_the_speed_of_the_motion():
    env = IceSkateVecEnv(1, action_period=0.02, render_mode="rgb_array")
    assert env.metadata["render_fps"] == 50 and env.metadata["render_modes"] == ["rgb_array"]
