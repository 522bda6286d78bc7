"""PPO that imitates the closed step of `training.push_only_orbit` (Peng et al. 2018, DeepMimic)."""
