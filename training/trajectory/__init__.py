"""Direct collocation of a gait step through its contact phases, and its closing in the engine.

``python -m training.trajectory`` makes training/orbits/push_only.npz; docs/push-only-orbit.md
describes how. `robot`, `dynamics` and `limits` state the problem, `nlp` and `problem` solve it with
IPOPT, `solution` keeps it; `engine` and `closing` repeat it in the engine. push_only_step.npz is
the solution with which the search begins.
"""
