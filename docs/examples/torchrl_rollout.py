"""TorchRL's GymEnv: a rollout of the batch as tensors.

Run it with ``python docs/examples/torchrl_rollout.py``.
"""

import torch
from torchrl.envs import GymEnv, RewardSum, TransformedEnv

torch.manual_seed(0)
env = TransformedEnv(GymEnv("skate_env:IceSkatePushOnly-v0", accuracy="fast"), RewardSum())
env.set_seed(0)
rollout = env.rollout(1000, break_when_any_done=False)
done = rollout["next", "done"].squeeze(-1)
returns = rollout["next", "episode_reward"][done]
print(
    f"observations {tuple(rollout['observation'].shape)}, actions {tuple(rollout['action'].shape)}"
)
print(f"{int(done.sum())} episodes, return {returns.mean():.2f}")
