"""Training and evaluation of residual policies.

`ppo`, `checkpoint` and `export` need Stable-Baselines3 and PyTorch, `statistics`
and `evaluation` need SciPy (all in the extra ``train``); the other modules need neither.
"""

# Seed of the first episode of an evaluation; environment i takes the i-th seed after it.
FIRST_EVALUATION_SEED = 1_000_000
# Largest seed of a training. Its environments take the following seeds, none of which is a seed of
# an evaluation.
LAST_TRAINING_SEED = FIRST_EVALUATION_SEED // 2
