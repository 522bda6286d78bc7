"""The paper's controller, complete and in part, without a learned action.

An action is added to the controller's torques, so the zero action replays the controller. A
baseline is a scene with that controller or a part of it, and a policy with zero actions.

Run it with ``python docs/examples/replay.py``.
"""

import gymnasium

from skate_env.policies import baseline

POLICIES = {
    "no residual": baseline.no_residual("paper"),
    "half the feedforward": baseline.scaled_feedforward("paper", 0.5),
    "visual lifting only": baseline.lifting_only("paper"),
}

print("Ten seconds of the paper's controller:")
for name, policy in POLICIES.items():
    env = gymnasium.make("skate_env:IceSkate-v0", scene=policy.scene, perturb=0.0)
    observation, info = env.reset(seed=0)
    over = False
    while info["time"] < 10.0 and not over:
        action, _ = policy.predict(observation)
        observation, reward, terminated, truncated, info = env.step(action)
        over = terminated or truncated
    end, slid = info["termination"] or "no end", info["loaded_slide"]
    print(f"{name:22} {slid:6.2f} m slid, {info['steps']:2} steps in {info['time']:5.2f} s, {end}")
    env.close()
