"""Gymnasium's wrappers around the batch: statistics of episodes, normalisation.

Run it with ``python docs/examples/wrappers.py``.
"""

import gymnasium
import numpy as np
from gymnasium.wrappers.vector import NormalizeObservation, NormalizeReward, RecordEpisodeStatistics

envs = gymnasium.make_vec("skate_env:IceSkatePushOnly-v0", num_envs=16, accuracy="fast")
record = RecordEpisodeStatistics(envs)
envs = NormalizeReward(NormalizeObservation(record), gamma=0.995)
envs.action_space.seed(0)
observations, infos = envs.reset(seed=0)
for _ in range(300):
    observations, rewards, terminated, truncated, infos = envs.step(envs.action_space.sample())
returns, lengths = np.array(record.return_queue), np.array(record.length_queue)
print(f"{len(returns)} episodes: return {returns.mean():.2f}, {lengths.mean():.0f} actions")
print(f"normalised observations: standard deviation {observations.std():.2f}")
envs.close()
