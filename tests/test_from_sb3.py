"""Policies of Stable-Baselines3 become a `Policy` with the same actions."""

import gymnasium
import numpy as np
import pytest
import torch
from stable_baselines3 import A2C, PPO, SAC
from stable_baselines3.common.env_util import make_vec_env
from stable_baselines3.common.vec_env import VecMonitor, VecNormalize

from skate_env import Policy
from skate_env.sb3 import IceSkateVecEnv

ID = "skate_env:IceSkatePushOnly-v0"


@pytest.fixture(autouse=True)
def _one_thread():
    torch.set_num_threads(1)


def envs(kind: str):
    if kind == "batch":
        return VecMonitor(IceSkateVecEnv(2, scene="push_only", action_period=0.02))
    return make_vec_env(ID, 2, seed=0)


@pytest.mark.parametrize("kind", ["batch", "vector of single ones"])
@pytest.mark.parametrize("net", [[8], [16, 12], []])
def test_actions_are_those_of_the_learner(kind, net, tmp_path):
    venv = VecNormalize(envs(kind))
    given = {"policy_kwargs": {"net_arch": net, "log_std_init": -0.5}, "device": "cpu"}
    model = PPO("MlpPolicy", venv, n_steps=64, batch_size=64, n_epochs=1, seed=0, **given)
    model.learn(256)
    # Of the environments' own normaliser, and of one that is given.
    Policy.from_sb3(model, venv).save(tmp_path / "policy.npz")
    policy = Policy.load(tmp_path / "policy.npz")
    assert policy.about["algorithm"] == "PPO" and policy.about["actions"] == 256
    env = gymnasium.make(ID)
    assert policy.scene == env.unwrapped.scene
    other = Policy.from_sb3(model, env, venv)
    np.testing.assert_array_equal(other.layers[-1][0], policy.layers[-1][0])
    own = gymnasium.make(ID, **policy.environment())
    seen, full = env.reset(seed=1)[0], own.reset(seed=1)[0]
    moved = [policy.joint_names.index(joint) for joint in env.unwrapped.joint_names]
    for _ in range(60):
        action, _ = model.predict(venv.normalize_obs(seen), deterministic=True)
        same, _ = policy.predict(full)
        # Single precision. Measured: 9e-7.
        right = policy.predict(seen)[0]
        np.testing.assert_allclose(right[moved], action, atol=5e-6)
        assert not np.delete(same, moved).any()
        seen, _, over, *_ = env.step(action)
        full, _, also, *_ = own.step(same)
        assert over == also
        if over:
            break
    # The motions differ by the rounding of the actions only. Measured: falls 1.3e-8 s apart.
    times = [each.unwrapped.simulator.time for each in (own, env)]
    assert times[0] == pytest.approx(times[1], abs=1e-5) and times[0] > 0.1


def test_a2c_without_a_normaliser():
    venv = envs("batch")
    model = A2C("MlpPolicy", venv, device="cpu", seed=0)
    policy = Policy.from_sb3(model, venv)
    assert not policy.mean.any() and (policy.std == 1.0).all()
    seen = venv.reset()
    moved = [policy.joint_names.index(joint) for joint in venv.get_attr("joint_names", 0)[0]]
    action, _ = model.predict(seen, deterministic=True)
    np.testing.assert_allclose(policy.predict(seen)[0][:, moved], action, atol=5e-6)


def test_what_is_no_such_policy_is_refused(refused):
    venv, env = envs("batch"), gymnasium.make(ID)
    relu = A2C("MlpPolicy", venv, device="cpu", policy_kwargs={"activation_fn": torch.nn.ReLU})
    refused(TypeError, lambda: Policy.from_sb3(relu, venv), "model", "tanh")
    noise = A2C("MlpPolicy", venv, device="cpu", use_sde=True)
    refused(TypeError, lambda: Policy.from_sb3(noise, venv), "model", "state-dependent")
    off = SAC("MlpPolicy", venv, device="cpu", buffer_size=10)
    refused(TypeError, lambda: Policy.from_sb3(off, venv), "model", "MlpPolicy")
    model = A2C("MlpPolicy", venv, device="cpu")
    refused(
        TypeError, lambda: Policy.from_sb3(model, gymnasium.make("CartPole-v1")), "env", "scene"
    )
    seen = gymnasium.make(ID, mirrored=False)
    refused(ValueError, lambda: Policy.from_sb3(model, seen), "mirrored")
    some = gymnasium.make(ID, joints=["q2"])
    refused(ValueError, lambda: Policy.from_sb3(model, some), "10 actions", "1 joints")
    Policy.from_sb3(model, env)
