"""Research on top of `skate_env`, which imports nothing of it.

- `gaits`: a search for the parameters that the paper leaves open.
- `orbits`: periodic orbits of gaits, their multipliers, and linear feedback about them.
- `trajectory`: collocation of a step in the paper's order on push-only ice.
- `imitation`: a policy that learns that step.
- `benchmark`: learners on the registered environments, RLlib, the policy for any ice.
- `sensitivity`: derivatives of a gait by the parameters of its scene.
"""
