"""Films of episodes with Gymnasium's RecordVideo; needs the extra: pip install "skate-env[render]".

Run it with ``python docs/examples/record.py videos``.
"""

import sys

import gymnasium
import numpy as np
from gymnasium.wrappers import RecordVideo

folder = sys.argv[1] if len(sys.argv) > 1 else "videos"
# An action of 20 ms gives 50 pictures per second.
env = gymnasium.make("skate_env:IceSkate-v0", render_mode="rgb_array")
env = RecordVideo(env, folder, episode_trigger=lambda episode: True, name_prefix="iceskate")

zero = np.zeros(env.action_space.shape, np.float32)
for phase in (0.0, 1.5):  # From the scene's start, and from the middle of the second step.
    env.reset(seed=0, options={"phase": phase})
    for _ in range(60):
        env.step(zero)
env.close()  # Writes the last film.
print("films in", folder)
