"""PPO in one file, as CleanRL has it, not tuned: ``python docs/examples/cleanrl.py [ACTIONS]``."""

import sys

import gymnasium
import torch
from torch import nn

n, t, gamma, log_std = 64, 128, 0.995, nn.Parameter(torch.full((10,), -1.0))
envs = gymnasium.make_vec(
    "skate_env:IceSkatePushOnly-v0", n, autoreset_mode="SameStep", accuracy="fast"
)
d, joints = envs.single_observation_space.shape[0], envs.single_action_space.shape[0]
actor, critic = (nn.Sequential(nn.Linear(d, 64), nn.Tanh(), nn.Linear(64, k)) for k in (joints, 1))
every = [*actor.parameters(), *critic.parameters(), log_std]
adam = torch.optim.Adam(every, 3e-4, eps=1e-5)
x = torch.from_numpy(envs.reset(seed=1)[0])  # Shares the memory of the array.
for update in range(int(sys.argv[1]) // (n * t) if len(sys.argv) > 1 else 400):
    seen, acted, reward, on = torch.zeros(t, n, d), torch.zeros(t, n, joints), *torch.zeros(2, t, n)
    for k in range(t):
        with torch.no_grad():
            seen[k], acted[k] = x, torch.normal(actor(x), log_std.exp())
        observations, rewards, terminated, truncated, _ = envs.step(acted[k].numpy())
        x, reward[k] = torch.from_numpy(observations), torch.from_numpy(rewards)
        on[k] = gamma * torch.from_numpy(~(terminated | truncated))
    with torch.no_grad():
        values, gain = critic(torch.cat([seen, x[None]])).squeeze(-1), torch.zeros(t + 1, n)
        for k in reversed(range(t)):
            gain[k] = reward[k] + on[k] * (values[k + 1] + 0.95 * gain[k + 1]) - values[k]
        old = torch.distributions.Normal(actor(seen), log_std.exp()).log_prob(acted).sum(-1)
    goal, scaled = gain[:-1] + values[:-1], (gain[:-1] - gain[:-1].mean()) / gain[:-1].std()
    rows = [each.flatten(0, 1) for each in (seen, acted, old, goal, scaled)]
    for part in (part for _ in range(10) for part in torch.randperm(n * t).split(2048)):
        o, a, before, target, advantage = (each[part] for each in rows)
        now = torch.distributions.Normal(actor(o), log_std.exp()).log_prob(a).sum(-1)
        ratio = (now - before).exp()
        policy = torch.minimum(ratio * advantage, ratio.clamp(0.8, 1.2) * advantage).mean()
        adam.zero_grad()
        (0.5 * (critic(o).squeeze(-1) - target).square().mean() - policy).backward()
        nn.utils.clip_grad_norm_(every, 0.5)
        adam.step()
    print(f"{(update + 1) * n * t} actions: {reward.mean() / 0.01:.2f} of reward per second")
