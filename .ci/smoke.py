"""Makes the environment from an installed package, and one action."""

import gymnasium

env = gymnasium.make("skate_env:IceSkate-v0")
assert env.reset(seed=0)[0] in env.observation_space
assert env.step(env.action_space.sample())[0] in env.observation_space
