"""The closed step on push-only ice in the paper's order."""

import numpy as np

from skate_env.contact_sequence import ORDER, SHORTEST_VISIT
from training.push_only_orbit import load, replay


def test_the_step_repeats_in_order_with_admissible_forces():
    made = replay(*load())
    assert made.residual < 1e-9  # 9e-12
    ends = [start for _, start in made.visits[1:]] + [0.729]
    long = [
        state
        for (state, start), end in zip(made.visits, ends, strict=True)
        if end - start >= SHORTEST_VISIT
    ]
    assert tuple(long) == ORDER
    assert made.torque.max() <= 150.0  # 140.5 N m
    assert made.loads.min() > -1e-9  # 0
    assert made.cone < 1.0 + 1e-9  # 1
    # Free foot on the ice after the first 250.5 ms.
    assert np.count_nonzero(made.loads[:, 1].sum(axis=1)) > 450  # 477
