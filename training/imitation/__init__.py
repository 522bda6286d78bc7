"""PPO that imitates the step of `training.orbits.push_only` (Peng et al. 2018, DeepMimic)."""
