"""PPO of Ray's RLlib on the batch, in this process.

Run it with ``python docs/examples/rllib.py [ITERATIONS]``. The settings are not tuned.
`training/benchmark/rllib.py` uses several processes and machines.
"""

import sys

import gymnasium
from ray.rllib.algorithms.ppo import PPOConfig
from ray.rllib.connectors.env_to_module import MeanStdFilter

iterations = int(sys.argv[1]) if len(sys.argv) > 1 else 300
config = (
    PPOConfig()
    .environment("skate_env:IceSkatePushOnly-v0", env_config={"accuracy": "fast", "num_threads": 1})
    .env_runners(
        num_env_runners=0,
        num_envs_per_env_runner=32,
        gym_env_vectorize_mode=gymnasium.VectorizeMode.VECTOR_ENTRY_POINT,
        env_to_module_connector=lambda *_, **__: MeanStdFilter(),
    )
    .training(train_batch_size_per_learner=4096, minibatch_size=2048, num_epochs=10, gamma=0.995)
    .debugging(seed=1)
)
algorithm = config.build_algo()
for _ in range(iterations):
    result = algorithm.train()["env_runners"]
    made = int(result["num_env_steps_sampled_lifetime"])
    # NaN before the first episode has ended.
    print(f"{made} actions: return {result.get('episode_return_mean', float('nan')):.1f}")
algorithm.stop()
