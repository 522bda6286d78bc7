"""TQC of sb3-contrib, an off-policy method, on single environments.

Run it with ``python docs/examples/contrib.py [ACTIONS]``. The settings are not tuned.
"""

import sys

from sb3_contrib import TQC
from stable_baselines3.common.env_util import make_vec_env
from stable_baselines3.common.evaluation import evaluate_policy
from stable_baselines3.common.vec_env import VecNormalize

actions = int(sys.argv[1]) if len(sys.argv) > 1 else 300_000
envs = VecNormalize(make_vec_env("skate_env:IceSkatePushOnly-v0", 16, seed=1), gamma=0.99)
small = {"net_arch": [64, 64], "log_std_init": -2.0}
model = TQC("MlpPolicy", envs, gradient_steps=4, policy_kwargs=small, seed=1, device="cpu")
model.learn(actions)
envs.training = envs.norm_reward = False
mean, deviation = evaluate_policy(model, envs, 16)
print(f"return {mean:.1f}, standard deviation {deviation:.1f}")
