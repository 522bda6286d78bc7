"""Train PPO with push-only contact, save, load, and compare with the baseline.

Run it with ``python docs/examples/sb3.py [STEPS [FOLDER]]``. The default of 200,000 environment
steps takes a minute; a skating policy needs millions.
"""

import sys
from pathlib import Path

import numpy as np
import torch
from stable_baselines3 import PPO
from stable_baselines3.common.evaluation import evaluate_policy
from stable_baselines3.common.vec_env import VecMonitor, VecNormalize

from skate_env.policies.baseline import no_residual
from skate_env.sb3 import IceSkateVecEnv

steps = int(sys.argv[1]) if len(sys.argv) > 1 else 200_000
folder = Path(sys.argv[2] if len(sys.argv) > 2 else "out/sb3")
folder.mkdir(parents=True, exist_ok=True)
keywords = {"scene": "push_only", "perturb": 0.01}
torch.set_num_threads(1)  # The networks are small; the other cores step the environments.

venv = VecNormalize(VecMonitor(IceSkateVecEnv(32, stagger=True, **keywords)), gamma=0.995)
settings = {"n_steps": 128, "batch_size": 1024, "gamma": 0.995, "device": "cpu", "seed": 0}
model = PPO("MlpPolicy", venv, policy_kwargs={"log_std_init": -1.0}, **settings)
model.learn(steps, progress_bar=True)
model.save(folder / "model.zip")
venv.save(str(folder / "normaliser.pkl"))

envs = VecMonitor(IceSkateVecEnv(8, **keywords))
envs = VecNormalize.load(str(folder / "normaliser.pkl"), envs)
envs.training = envs.norm_reward = False  # Fixed statistics, and returns in the units of the task.
loaded = PPO.load(folder / "model.zip", device="cpu")

for name, each in {"baseline": no_residual("push_only"), "learned": loaded}.items():
    envs.seed(1)
    returns, lengths = evaluate_policy(each, envs, 16, return_episode_rewards=True)
    print(f"{name}: return {np.mean(returns):.2f}, {np.mean(lengths) / 100:.2f} s an episode")
