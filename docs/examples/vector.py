"""64 environments in one batch, in the engine's threads, with statistics of their episodes.

Run it with ``python docs/examples/vector.py``.
"""

from collections import Counter

import gymnasium
import numpy as np
from gymnasium.vector import AutoresetMode

envs = gymnasium.make_vec(
    "skate_env:IceSkate-v0",
    num_envs=64,
    scene="push_only",
    perturb=0.01,
    max_episode_steps=300,
    autoreset_mode=AutoresetMode.SAME_STEP,
    num_threads=2,  # Results do not depend on it.
)
envs.action_space.seed(0)
# Different first time limits, so that episodes do not end at the same time.
elapsed = np.random.default_rng(0).integers(0, 300, envs.num_envs)
observations, infos = envs.reset(seed=0, options={"elapsed": elapsed})

running = np.zeros(envs.num_envs)
returns, steps, ends = [], [], Counter()
for _ in range(300):
    actions = 0.1 * envs.action_space.sample()
    observations, rewards, terminated, truncated, infos = envs.step(actions)
    running += rewards
    if (over := terminated | truncated).any():
        last = infos["final_info"]  # `infos` belong to the next episode.
        returns += running[over].tolist()
        steps += last["steps"][over].tolist()
        ends.update(str(cause or "time limit") for cause in last["termination"][over])
        running[over] = 0.0

print(f"{len(returns)} episodes:", ", ".join(f"{n} {end}" for end, n in sorted(ends.items())))
print(f"a return of {np.mean(returns):.2f} and {np.mean(steps):.1f} steps on average")
envs.close()
