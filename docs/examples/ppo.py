"""PPO of Stable-Baselines3 learns to skate; the training needs no code of this package.

Run it with ``python docs/examples/ppo.py [ID [SEED [ACTIONS [FOLDER]]]]``; the settings are the
same for every id. Training uses time steps of 1 ms, evaluation the default accuracy. Afterwards
``skate-env replay --policy out/ppo/policy.npz`` plays the policy.
"""

import sys
from pathlib import Path

import gymnasium
from stable_baselines3 import PPO
from stable_baselines3.common.env_util import make_vec_env
from stable_baselines3.common.vec_env import VecNormalize

from skate_env import Policy

given = dict(enumerate(sys.argv))
name, folder = given.get(1, "IceSkate-v0"), Path(given.get(4, "out/ppo"))
seed, actions = int(given.get(2, 0)), int(given.get(3, 1_500_000))
folder.mkdir(parents=True, exist_ok=True)

coarse = {"accuracy": {"method": "moreau", "step": 0.001}}
envs = VecNormalize(make_vec_env(f"skate_env:{name}", 64, seed, env_kwargs=coarse), gamma=0.99)
settings = {"n_steps": 64, "batch_size": 2048, "n_epochs": 10, "gamma": 0.99}
settings |= {"learning_rate": lambda left: 1e-3 * left, "policy_kwargs": {"log_std_init": -0.5}}
model = PPO("MlpPolicy", envs, seed=seed, device="cpu", **settings)
model.learn(actions)
model.save(folder / "model.zip")
envs.save(str(folder / "normaliser.pkl"))

env = gymnasium.make(f"skate_env:{name}")
Policy.from_sb3(model, env, envs).save(folder / "policy.npz")
for episode in range(8):
    observation, info = env.reset(seed=1_000_000 + episode)
    over, total = False, 0.0
    while not over:
        action, _ = model.predict(envs.normalize_obs(observation), deterministic=True)
        observation, reward, terminated, truncated, info = env.step(action)
        over, total = terminated or truncated, total + reward
    print(f"{info['steps']} steps in {info['time']:.2f} s, return {total:.1f}")
