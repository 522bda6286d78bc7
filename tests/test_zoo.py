"""RL Baselines3 Zoo trains with the hyperparameters of this repository, as the example does."""

import os
import subprocess
import sys
from pathlib import Path

import numpy as np
from stable_baselines3 import PPO

ROOT = Path(__file__).parents[1]
# One update: 64 actions in each of 64 environments.
ACTIONS = "4096"


def run(*command):
    environment = os.environ | {"OMP_NUM_THREADS": "1"}
    command = [sys.executable, *map(str, command)]
    done = subprocess.run(command, capture_output=True, text=True, timeout=300, env=environment)
    assert done.returncode == 0, done.stdout + done.stderr


def weights(file):
    model = PPO.load(file, device="cpu", custom_objects={"learning_rate": 0.0})
    assert model.num_timesteps == int(ACTIONS)
    return {name: value.numpy() for name, value in model.policy.state_dict().items()}


def test_the_zoo_makes_the_policy_of_the_example(tmp_path):
    settings = ROOT / "training" / "benchmark" / "hyperparameters" / "ppo.yml"
    run(
        *("-m", "rl_zoo3.train", "--algo", "ppo", "--env", "IceSkatePushOnly-v0"),
        *("--gym-packages", "skate_env", "--conf-file", settings),
        *("--n-timesteps", ACTIONS, "--seed", "1", "--device", "cpu", "-f", tmp_path),
    )
    saved = tmp_path / "ppo" / "IceSkatePushOnly-v0_1"
    assert (saved / "IceSkatePushOnly-v0" / "vecnormalize.pkl").exists()
    example = ROOT / "docs" / "examples" / "ppo.py"
    run(example, "IceSkatePushOnly-v0", "1", ACTIONS, tmp_path / "example")
    zoo = weights(saved / "IceSkatePushOnly-v0.zip")
    example = weights(tmp_path / "example" / "model.zip")
    for name, value in example.items():
        np.testing.assert_array_equal(zoo[name], value, name)
