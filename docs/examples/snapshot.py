"""Save an environment, try several actions from that state, restore it and continue.

Run it with ``python docs/examples/snapshot.py``.
"""

import pickle

import numpy as np

from skate_env.environments import IceSkateEnv

env = IceSkateEnv("paper_arms", perturb=0.01)
env.action_space.seed(0)
observation, info = env.reset(seed=0)
zero = np.zeros(env.action_space.shape, np.float32)


def play(env: IceSkateEnv, action: np.ndarray, n: int) -> tuple[float, np.ndarray]:
    """Apply an action n times or to the episode's end; return the return and last observation."""
    total = 0.0
    for _ in range(n):
        observation, reward, terminated, _, _ = env.step(action)
        total += reward
        if terminated:
            break
    return total, observation


play(env, zero, 100)
saved = env.snapshot()  # Bytes with state, controller and random generator.
clone = pickle.loads(pickle.dumps(env))  # A complete environment, for example for another process.

tried = [zero] + [0.3 * env.action_space.sample() for _ in range(4)]
for i, action in enumerate(tried):
    env.restore(saved)
    total, _ = play(env, action, 20)
    head = env.simulator.head_position[2]
    print(f"action {i} over 0.2 s: return {total:.4f}, head at {head:.2f} m")

env.restore(saved)
total, observation = play(env, zero, 200)
again, same = play(clone, zero, 200)
print(f"two seconds from the snapshot and from the pickle: {total!r}, {again!r}")
print("bit for bit the same:", total == again and np.array_equal(observation, same))
