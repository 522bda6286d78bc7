"""RL Baselines3 Zoo trains with the hyperparameters of this repository, without changes."""

import os
import subprocess
import sys
from pathlib import Path

HYPERPARAMETERS = Path(__file__).parents[1] / "training" / "hyperparameters" / "ppo.yml"


def test_the_zoo_trains_and_saves(tmp_path):
    command = [
        sys.executable,
        "-m",
        "rl_zoo3.train",
        "--algo",
        "ppo",
        "--env",
        "IceSkatePushOnly-v0",
    ]
    command += ["--gym-packages", "skate_env", "--conf-file", str(HYPERPARAMETERS)]
    command += ["--n-timesteps", "8192", "--seed", "1", "--device", "cpu", "-f", str(tmp_path)]
    environment = os.environ | {"OMP_NUM_THREADS": "1"}
    run = subprocess.run(command, capture_output=True, text=True, timeout=300, env=environment)
    assert run.returncode == 0, run.stdout + run.stderr
    saved = tmp_path / "ppo" / "IceSkatePushOnly-v0_1"
    assert (saved / "IceSkatePushOnly-v0.zip").exists()
    assert (saved / "IceSkatePushOnly-v0" / "vecnormalize.pkl").exists()
