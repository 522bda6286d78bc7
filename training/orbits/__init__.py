"""Periodic orbits of gaits; docs/orbits.md, docs/orbit-feedback.md and docs/push-only-orbit.md.

- `strobe`: the map from one sample of the controller to a later one, with its derivative.
- `close`, `forced`: orbits of a scene, and of a policy's motion with its torques.
- `measure`, `study`, `chart`: what ``python -m training.orbits`` measures, prints and draws.
- `feedback`, `linear_quadratic`: linear feedback by Riccati equations, a policy.
- `push_only`: the closed steps on push-only ice of push_only.npz, with a fifth of the published
  torques, and push_only_all.npz, with all of them.
"""
