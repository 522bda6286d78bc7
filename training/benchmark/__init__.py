"""Learners on the registered environments; docs/generated/benchmark.md has the results.

``python -m training.benchmark train`` repeats a training with the settings of `learners`, and
``report`` draws those of `results`; `held_out` evaluates. `any_ice` trains the shipped policy for
any ice on `several` scenes, `rllib` with PPO on several machines. push_only_seed_1.npz is a policy
about which docs/orbits.md designs a feedback.
"""
