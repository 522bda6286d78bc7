"""PPO that imitates the step of `training.orbits.push_only` (Peng et al. 2018, DeepMimic).

``python -m training.imitation`` trains; docs/push-only-orbit.md has the results.
`reference` is the step and its scene, `env` the environments with the reward. `policies` has two
policies in the paper's order on push-only ice, of earlier versions of the program.
"""
